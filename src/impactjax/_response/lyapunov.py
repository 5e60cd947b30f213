"""The verbs `lyapunov` and `lyapunov_diagram`: Lyapunov exponents of forced systems."""

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float

from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.system import HybridSystem
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._refusal import whole
from impactjax._response.exponents import Exponents, exponents_of
from impactjax._response.forced import Forced, forced
from impactjax._response.parameter import Where, place_of
from impactjax._response.period import Period
from impactjax._response.portions import in_portions
from impactjax._response.sampler import Counts
from impactjax._response.swept import Swept, as_values
from impactjax._simulate.step import AbstractStep
from impactjax._types import Numbers, Scalar


def lyapunov(
    system: HybridSystem | ImpactOscillator,
    start: Start | InitialState,
    period: Period,
    *,
    count: int = 1000,
    settle: int = 100,
    tolerance: ArrayLike | None = None,
    step: AbstractMethod | AbstractStep | None = None,
) -> Exponents:
    """Lyapunov exponents of a motion, through all its events.

    Disturbances run beside the motion, by exact derivatives with the saltation at events, and are
    made orthogonal after each period. An exponent is −∞ where a disturbance dies out
    completely, as at rest on a stop. Batches are made by `jax.vmap`, or by `lyapunov_diagram`.

    **Arguments:**

    - `system`, `start`: the system, and where the motion starts: for an `ImpactOscillator` an
      `InitialState`, at time 0. An oscillator has two exponents, of position and velocity.
    - `period`: time after which disturbances are made orthogonal again, such as the period of the
      force; they must not grow beyond rounding in it. A number, or a function of the system.
    - `count`: number of periods that are counted.
    - `settle`: number of periods before them, in which the motion settles; disturbances begin in
      the last tenth.
    - `tolerance`, `step`: as for `solve`, or `simulate`.

    **Raises** `ValueError` for a period that is not positive; `TypeError` for arguments of the
    wrong type.

    Source: G. Benettin et al., Meccanica 15 (1980) 9; jumps by P. C. Müller, Chaos, Solitons and
    Fractals 5 (1995) 1671. Errors by batch means with √count batches.
    """
    counts = Counts(whole("count", count, least=4), whole("settle", settle, least=1))
    own = forced(system, start, period, counts, tolerance, step)
    return _exponents(own)


def lyapunov_diagram(
    system: HybridSystem | ImpactOscillator,
    start: Start | InitialState,
    period: Period,
    where: Where,
    values: Numbers,
    *,
    count: int = 200,
    settle: int = 100,
    tolerance: ArrayLike | None = None,
    step: AbstractMethod | AbstractStep | None = None,
) -> Exponents:
    """Lyapunov exponents of a forced system over values of a parameter.

    All motions run side by side, on all processors, with progress on a terminal. Each array of the
    result has an axis of the values before its own.

    **Arguments:**

    - `system`, `start`, `period`, `where`, `values`: as for `diagram`.
    - `count`, `settle`: numbers of periods that are counted, and left out before them.
    - `tolerance`, `step`: as for `solve`, or `simulate`.

    **Raises** as `diagram` and `lyapunov` do.
    """
    counts = Counts(whole("count", count, least=4), whole("settle", settle, least=1))
    own = forced(system, start, period, counts, tolerance, step)
    swept = Swept(own, place_of(own.system, where))
    return in_portions(_side_by_side, swept, as_values(values))


@eqx.filter_jit
def _exponents(own: Forced) -> Exponents:
    begun = own.run.begun(own.system, own.start)
    return exponents_of(own.run.growth(own.system, begun), own.run.period(own.system))


@eqx.filter_jit
def _side_by_side(swept: Swept, values: Float[Array, " values"]) -> Exponents:
    run = swept.forced.run

    def motion(value: Scalar) -> Exponents:
        return exponents_of(swept.growth(value), run.period(swept.at(value)))

    return run.side_by_side(motion, values)

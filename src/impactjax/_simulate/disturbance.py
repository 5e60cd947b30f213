"""Bound of a step by the growth of a small disturbance of the state, for accurate derivatives.

The motion itself may not bound the step. A mass at its equilibrium, or one that creeps in a stop,
allows steps of any length, but over a long step the derivative by the initial state would be wrong.
"""

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from impactjax._hybrid.varying import alike
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.driving import driving_rate
from impactjax._simulate.step import AbstractStep, Point
from impactjax._types import Scalar

_STABLE = 0.8  # of the step whose last term fades as fast as the motion
_SQUARINGS = 8
_POWER = 2**_SQUARINGS


def longest_step(
    automaton: Automaton, start: Point, begun: Scalar, step: AbstractStep, tolerance: Scalar
) -> Scalar:
    """The longest step [s] that follows a small disturbance within the tolerance.

    With the flow's Jacobian A, a disturbance at the begin of the phase, `begun`, has become e^(Aτ)
    times it. The error of a step is (A h)ⁿ e^(Aτ), beside which the disturbance itself is e^(Aτ):
    what fades faster than the rest asks for stability only, as if the tolerance were the share of
    damping in its rate. A disturbance of a parameter does not fade, and in the long run its effect
    on a damped flow is as fast as what drives the flow. A driving force counts however small its
    amplitude, by which there may be a derivative.
    """
    jacobian, age = _jacobian(automaton, start), (start.t - begun) / step.power
    rates = _rates_of_two if len(jacobian) == 2 else _rates
    fastest, lasting, damping = rates(jacobian, age)
    lasting = jnp.maximum(lasting, driving_rate(automaton.model, start.t, start.y))
    accurate = _over(step.reach(tolerance), lasting)
    stable = _over(_STABLE * step.reach(jnp.maximum(damping, tolerance)), fastest)
    return jnp.minimum(accurate, stable)


def _jacobian(automaton: Automaton, start: Point) -> Float[Array, "n n"]:
    """The Jacobian of the flow by the state; 0 where it is not finite."""
    state, unravel = ravel_pytree(start.y)

    def rates(state: Array) -> Array:
        return ravel_pytree(automaton.flow(start.t, unravel(state), start.mode))[0]

    directions = alike(jnp.eye(state.size, dtype=state.dtype), state)
    matrix = jax.vmap(lambda d: jax.jvp(rates, (state,), (d,))[1])(directions)
    return jnp.where(jnp.all(jnp.isfinite(matrix)), matrix, 0.0)


def _rates_of_two(matrix: Float[Array, "2 2"], time: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """`_rates` of two states, from the eigenvalues m ± √q of A: the larger |λ|, and the larger
    |λ e^(λ time)| over the larger of |e^(λ time)| and 1, the disturbance of a parameter; and the
    damping ratio of complex eigenvalues.
    """
    (a, b), (c, d) = matrix
    mean, q = (a + d) / 2, ((a - d) / 2) ** 2 + b * c
    real, imaginary = jnp.sqrt(jnp.maximum(q, 0)), jnp.sqrt(jnp.maximum(-q, 0))
    slow, fast = jnp.hypot(mean + real, imaginary), jnp.hypot(mean - real, imaginary)
    fastest, grown = jnp.maximum(slow, fast), jnp.maximum(mean + real, 0.0)
    lasting = jnp.maximum(
        slow * jnp.exp((mean + real - grown) * time), fast * jnp.exp((mean - real - grown) * time)
    )
    complex_ = (imaginary > 0) & (mean < 0)
    return fastest, lasting, jnp.where(complex_, -mean / jnp.where(complex_, slow, 1.0), 1.0)


def _rates(matrix: Float[Array, "n n"], time: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """The spectral radius of A, and that of A e^(A time) over that of e^(A time), with a time cut
    where no difference is left; and 1 for a damping that is not known.
    """
    fastest = _spectral_radius(matrix)
    time = jnp.minimum(time, _over(jnp.asarray(_POWER / 2, matrix.dtype), fastest))
    faded, _ = _large_power(jnp.eye(len(matrix), dtype=matrix.dtype) + matrix * time / _POWER)
    lasting = _spectral_radius(matrix @ faded) / _spectral_radius(faded)
    return fastest, lasting, jnp.ones_like(lasting)


def _spectral_radius(matrix: Float[Array, "n n"]) -> Scalar:
    """‖Aᵐ‖^(1/m) for a large m, which tends to it by Gelfand's formula."""
    return jnp.exp(_large_power(matrix)[1] / _POWER)


def _large_power(matrix: Float[Array, "n n"]) -> tuple[Float[Array, "n n"], Scalar]:
    """Aᵐ over its largest element, and the logarithm of that."""
    least = jnp.finfo(matrix.dtype).tiny
    power, logarithm = matrix, jnp.zeros((), matrix.dtype)
    for _ in range(_SQUARINGS):
        size = jnp.maximum(jnp.max(jnp.abs(power)), least)
        power = power / size
        power = jnp.sum(power[:, :, None] * power[None], axis=1)
        logarithm = 2 * (logarithm + jnp.log(size))
    size = jnp.maximum(jnp.max(jnp.abs(power)), least)
    return power / size, logarithm + jnp.log(size)


def _over(number: Scalar, rate: Scalar) -> Scalar:
    """A time, which may be infinite."""
    return jnp.where(rate > 0, number / jnp.where(rate > 0, rate, 1.0), jnp.inf)

"""Settings of the Levenberg-Marquardt method."""

import itertools

import equinox as eqx

from impactjax._shown import with_numbers


class LevenbergMarquardt(eqx.Module):
    """Settings of the Levenberg-Marquardt method.

    **Arguments:**

    - `max_iterations`: evaluations of residuals and Jacobian, for each part of the record.
    - `reduction`: relative decrease of the sum of squares below which the search has converged.
    - `damping`: initial damping, relative to the curvature.
    - `horizons`: fractions of the record that are fitted one after the other, each starting from
      the minimum of the previous one; the last is 1. Over a short time a simulated motion far from
      the recorded one is still in phase with it, so that the search ends at the right minimum.

    Source: K. Levenberg (1944), "A method for the solution of certain non-linear problems in least
    squares", Quarterly of Applied Mathematics 2; D. W. Marquardt (1963), "An algorithm for
    least-squares estimation of nonlinear parameters", Journal of SIAM 11.
    """

    max_iterations: int = eqx.field(default=150, static=True)
    reduction: float = eqx.field(default=1e-8, static=True)
    damping: float = eqx.field(default=1e-3, static=True)
    horizons: tuple[float, ...] = eqx.field(default=(0.25, 0.5, 1.0), static=True)

    def __check_init__(self) -> None:
        if self.max_iterations < 1:
            raise ValueError(
                f"Argument `max_iterations` must be at least 1, but it is {self.max_iterations}."
            )
        rising = all(a < b for a, b in itertools.pairwise((0.0, *self.horizons)))
        if not (rising and self.horizons and self.horizons[-1] == 1):
            raise ValueError(
                "Argument `horizons` must rise from above 0 to 1, such as (0.25, 0.5, 1.0), but it "
                f"is {self.horizons}."
            )

    __repr__ = with_numbers

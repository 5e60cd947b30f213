"""The settings of Levenberg and Marquardt's method."""

import itertools

import equinox as eqx

from impactjax._shown import with_numbers


class LevenbergMarquardt(eqx.Module):
    """The optimiser's settings.

    **Arguments:**

    - `max_iterations`: evaluations of residuals and Jacobian, for each part of the record.
    - `reduction`: relative decrease of the sum of squares below which it has converged.
    - `damping`: first damping, relative to the curvature.
    - `horizons`: parts of the record, as fractions of it, that are fitted one after the other, each
      from where the last one ended; the last is the whole. Over a short time a motion far from the
      recorded one has not yet lost its phase: a search from afar ends at the right minimum.
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

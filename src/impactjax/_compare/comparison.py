"""The result of a comparison: models fitted to one recording."""

import dataclasses
import textwrap
from collections.abc import Iterator
from typing import NamedTuple

from impactjax._compare.holdout import Prediction
from impactjax._compare.oscillators import is_dry
from impactjax._first_look.first_look import FirstLook
from impactjax._fit.estimate import Estimate
from impactjax._problem.problem import Problem


class Fitted(NamedTuple):
    """One model fitted to a recording.

    - `name`: name of the experiment.
    - `estimate`: estimate with intervals from profile likelihoods.
    - `seconds`: computing time.
    - `stated`: names of the parameters whose values the user stated.
    - `worse_than`: names of special cases of the model that fit better. That is a failure of the
      search, so the estimate counts as not converged.
    - `prediction`: prediction of what was held out; `None` if nothing was.
    """

    name: str
    estimate: Estimate[Problem]
    seconds: float
    stated: tuple[str, ...] = ()
    worse_than: tuple[str, ...] = ()
    prediction: Prediction | None = None

    @property
    def is_free_flight(self) -> bool:
        """True if the model has no stop."""
        model = self.estimate.problem.system.model
        return model.lower is None and model.upper is None

    @property
    def is_dry(self) -> bool:
        """True if the oscillator has dry friction."""
        return is_dry(self.estimate.problem.system.model.oscillator)


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Models fitted to one recording, sorted by Akaike's criterion, the best first.

    - `name`: name of the recording.
    - `fits`: one fit for each model.
    - `first_look`: first look at the recording, if `prepare` took one.
    - `notes`: sentences on changes to the recording, and on parameters that it asked for.
    - `seed`: random seed of the scattered starts.

    It is a sequence of its fits, and gives each by its name: `comparison["kelvin-voigt"]`.
    """

    name: str
    fits: tuple[Fitted, ...]
    first_look: FirstLook | None = None
    notes: tuple[str, ...] = ()
    seed: int = 0

    @property
    def best(self) -> Fitted:
        """The fit with the best criterion. Raises `ValueError` if there is none."""
        if not self.fits:
            raise ValueError("No model was fitted.")
        return self.fits[0]

    def __repr__(self) -> str:
        return f"Comparison({self.name!r}, {', '.join(each.name for each in self.fits)})"

    def __str__(self) -> str:
        least = min((float(each.estimate.aic) for each in self.fits), default=0.0)
        parts = [
            f"{each.name}, AIC {float(each.estimate.aic) - least:+.1f}:\n"
            + textwrap.indent(str(each.estimate), "  ")
            for each in self.fits
        ]
        return "\n".join([*parts, *self.notes])

    def __iter__(self) -> Iterator[Fitted]:
        return iter(self.fits)

    def __len__(self) -> int:
        return len(self.fits)

    def __getitem__(self, which: int | str) -> Fitted:
        if isinstance(which, int):
            return self.fits[which]
        names = [fitted.name for fitted in self.fits]
        if which not in names:
            raise KeyError(f"`{which}` was not fitted; {', '.join(names)} were.")
        return self.fits[names.index(which)]

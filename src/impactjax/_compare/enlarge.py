"""Parameters beside those of the models: what the record asks for is fitted as well."""

from impactjax._compare.asked_for import (
    asked_for,
    behind,
    freed,
    newly_fitted,
    rubbed,
    undecided,
    words,
)
from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Change, Settings, fit_models, ranked
from impactjax._compare.oscillators import DRY_FRICTION
from impactjax._compare.prepare import WITH_DRY_FRICTION
from impactjax._compare.ranking import CLEAR, fall
from impactjax._problem.experiment import Experiment
from impactjax._sensor.low_pass import Butterworth


def enlarged(
    own: dict[str, Experiment],
    fits: dict[str, Fitted],
    may_rub: frozenset[str],
    low_pass: Butterworth | None,
    settings: Settings,
) -> Change | None:
    """The change that the best fit asks for: a low-pass, parameters that it held, or dry friction
    if that lowers the criterion more; `None` without need.
    """
    best = ranked(fits)[0]
    if low_pass is not None:
        filtered = _with_low_pass(own, fits, best, low_pass, settings)
        if filtered is not None:
            return filtered
    change = _with_parameters(own, fits, best, settings)
    left = best if change is None else ranked(change.fits)[0]
    if best.is_dry or best.name not in may_rub or best.name + WITH_DRY_FRICTION in own:
        return change
    return _with_friction(own, fits, may_rub, best, left, settings) or change


def _with_low_pass(
    own: dict[str, Experiment],
    fits: dict[str, Fitted],
    best: Fitted,
    low_pass: Butterworth,
    settings: Settings,
) -> Change | None:
    """All models behind a low-pass; `None` if there is one, if no residuals exceed the noise, or if
    it does not lower the criterion clearly. It may only have led a search out of a false minimum:
    then that is repeated without it.
    """
    if own[best.name].sensor.low_pass is not None or not bool(best.estimate.exceeds_noise):
        return None
    wider = {name: behind(each, low_pass) for name, each in own.items()}
    more = fit_models(wider, settings, fits)
    after = ranked(more)[0]
    if not fall(best.estimate, after.estimate) >= CLEAR:
        return None
    again = fit_models(own, settings, more)
    if fall(ranked(again)[0].estimate, after.estimate) < CLEAR:
        return Change(own, again, "The search was repeated from a lower minimum.")
    before = fits[after.name].estimate
    said = words([newly_fitted("cutoff", before, after.estimate)], before, after.estimate)
    return Change(wider, more, said)


def _with_parameters(
    own: dict[str, Experiment], fits: dict[str, Fitted], best: Fitted, settings: Settings
) -> Change | None:
    """All models with the parameters that the best fit held and the record asks for; `None` if they
    do not lower the criterion.
    """
    found = asked_for(best.estimate, own[best.name], settings.search)
    if not found:
        return None
    wider = {x: freed(own[x], fits[x].estimate.problem, found) for x in own}
    more = fit_models(wider, settings, fits)
    if not fall(best.estimate, ranked(more)[0].estimate) > 0:
        return None
    return Change(wider, more, words(found, best.estimate, more[best.name].estimate))


def _with_friction(
    own: dict[str, Experiment],
    fits: dict[str, Fitted],
    may_rub: frozenset[str],
    best: Fitted,
    left: Fitted,
    settings: Settings,
) -> Change | None:
    """All models with dry friction if it lowers the criterion clearly; the best one with friction
    as one more model if it lowers it less; `None` if it does not, or less than the parameters that
    `left` has beside those of `best`.
    """
    variant = best.name + WITH_DRY_FRICTION
    rubs = {variant: rubbed(own[best.name])}
    dry = fit_models(rubs, settings, {variant: best})
    needs = newly_fitted(DRY_FRICTION, best.estimate, dry[variant].estimate)
    if not fall(left.estimate, dry[variant].estimate) > 0:
        return None
    if needs.gain >= CLEAR:
        own = {name: rubbed(each) if name in may_rub else each for name, each in own.items()}
        said = words([needs], best.estimate, dry[variant].estimate)
        return Change(own, fit_models(own, settings, fits), said)
    return Change(own | rubs, fits | dry, undecided(needs)) if left is best else None

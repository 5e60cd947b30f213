"""Events, and the functions of the state that fall through zero at them."""

from .compiled import compiled
from .physics import DRY, HAS_DRY, free, place, side
from .stepping import drive, pushing

NOTHING, IMPACT, TURN, FORCE_FALLS, FORCE_RISES, SURFACE, SLIP = range(7)


@compiled
def clearance(p, stop, y):
    """Distance from a stop in units of the coordinate, negative inside it."""
    return side(stop) * ((y[3] - place(p, stop)) + y[0])


@compiled
def holding(kinds, p, stop, t):
    """Push onto a rigid stop and dry friction, which together keep a mass there."""
    held = p[DRY] if kinds[HAS_DRY] == 1 else 0.0j
    return -side(stop) * free(kinds, p, t, place(p, stop), 0.0j) + held


@compiled
def guard(kinds, p, m, event, t, y):
    """The function of the state that falls through zero at an event."""
    if event == FORCE_FALLS:
        return pushing(kinds, p, m, y)
    if event == FORCE_RISES:
        return -pushing(kinds, p, m, y)
    if event == SLIP:
        pull = drive(kinds, p, m, t, y)
        return p[DRY] - (pull if pull.real > 0 else -pull)
    if event == TURN:
        return y[1]
    return clearance(p, m[1], y)


@compiled
def slope(kinds, p, m, event, t, y):
    """Time derivative of the guard of a turn, or of a passage of a stop."""
    if event != TURN:
        return side(m[1]) * y[1]
    acceleration = drive(kinds, p, m, t, y)
    return acceleration - m[2] * p[DRY] if kinds[HAS_DRY] == 1 else acceleration


@compiled
def is_held(kinds, m):
    """Tell whether dry friction keeps the mass where it is."""
    return kinds[HAS_DRY] == 1 and m[2] == 0


@compiled
def direction(kinds, p, m, t, y, slips):
    """Direction in which a mass starts to slide from standing still; 0 if friction holds it."""
    if kinds[HAS_DRY] == 0:
        return 0
    pull = drive(kinds, p, m, t, y).real
    if not slips and abs(pull) <= p[DRY].real:
        return 0
    return 1 if pull > 0 else -1

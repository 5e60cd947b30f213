"""Result codes of a simulated lane, each with its message."""

import equinox as eqx


class RESULTS(eqx.Enumeration):
    """Result of one simulated lane. The message of each failure names the next thing to try."""

    successful = "successful"
    max_steps_reached = (
        "The run needs more steps than `max_steps`. Samples after the last step are NaN. Raise "
        "`max_steps`; if the motion is an endless series of ever smaller impacts, the law's "
        "restitution does not fall below one there."
    )
    max_impacts_reached = (
        "There were more impacts or rests than `max_impacts`. The samples are right; the logs hold "
        "only the first ones. Raise `max_impacts`."
    )
    stopped_through = (
        "The mass ended a step on the wrong side of a stop. Please report this: it should not "
        "happen. Samples after that are NaN."
    )
    starts_inside_stop = (
        "The initial position lies inside a rigid stop. Move it to the free side of the gap."
    )
    times_out_of_order = (
        "The sample times do not increase strictly, or `t0` is after the first of them."
    )
    impossible_parameters = (
        "A parameter is not finite or outside its range (negative mass, r above one, stops in the "
        "wrong order, a factor that is not positive, ...). Build the model outside `jit` to see "
        "which."
    )
    restitution_out_of_range = (
        "At some impact the law's restitution was below 0 or above 1, or it does not hold. The "
        "impact is too fast or too slow for the law. Samples after that are NaN."
    )
    tolerance_too_small = (
        "The tolerance is smaller than the floating-point type can give. Use a larger one, or "
        "double precision."
    )
    time_too_coarse = (
        "Time is counted from so far away that its own rounding exceeds the tolerance. The samples "
        "are as accurate as time is. Count time from near the start of the run, or ask for a "
        "larger `tolerance`."
    )
    step_too_small = (
        "The step became too small to advance time: the motion has a singularity, or the "
        "tolerance asks too much. Samples after that are NaN."
    )
    non_finite = (
        "The state became infinite or NaN: the law, the oscillator or the motion of its base is "
        "not defined there. Samples after that are NaN."
    )
    max_events_reached = (
        "There were more events than `max_events`. The samples are right; the log holds only the "
        "first ones. Raise `max_events`."
    )
    event_repeats = (
        "An event repeats endlessly, in ever less time or in none. Change the mode in its jump, so "
        "that its guard no longer applies, or give the transition a `tail`. Samples after that are "
        "NaN."
    )
    no_orbit_found = (
        "Newton's method does not converge to a periodic orbit with the events of this motion. "
        "Start closer to one: raise `settle`, or change `start` or `multiple`."
    )
    another_itinerary = (
        "The equations of the orbit are solved, but the motion from there has other events. "
        "Start from a motion with the events of an orbit: raise `settle`, or change `start`."
    )

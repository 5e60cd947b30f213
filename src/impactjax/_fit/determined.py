"""Distinction of parameters that the observations determine, to first order, from the others."""

from jaxtyping import Bool, Float

from impactjax._known import AnyArray, namespace

_ABSENT = 1e-8  # squared component of a parameter in a direction that counts as none


def determined(
    directions: Float[AnyArray, "directions parameters"], felt: Bool[AnyArray, " directions"]
) -> Bool[AnyArray, " parameters"]:
    """Mask of the parameters without a component in a direction that changes no observation.

    Directions are orthonormal rows, in scaled parameters; `felt` tells which change observations.
    """
    xp = namespace(directions, felt)
    lost = xp.where(felt[:, None], 0.0, directions)
    return xp.sum(lost**2, axis=0) <= _ABSENT

"""Rules for the end of a compliant contact."""

import equinox as eqx

from impactjax._shown import with_numbers


class AbstractSeparation(eqx.Module):
    """The rule by which a compliant contact ends."""

    __repr__ = with_numbers


class AtZeroPenetration(AbstractSeparation):
    """End of contact where the penetration returns to zero (the thesis).

    A law with damping pulls the mass back just before that.
    """


class AtZeroForce(AbstractSeparation):
    """End of contact where the force falls to zero, so that it never pulls.

    The mass leaves while the stop is still indented. The stop has recovered when the mass has left
    the indentation. If the mass turns back before that, contact resumes as soon as the force of the
    law is positive.

    Source: Schwager & Pöschel, Granular Matter 9, 465 (2007).
    """

"""When a contact ends."""

import equinox as eqx

from impactjax._shown import with_numbers


class AbstractSeparation(eqx.Module):
    """The rule by which a compliant contact ends."""

    __repr__ = with_numbers


class AtZeroPenetration(AbstractSeparation):
    """The contact ends where the penetration returns to zero (the thesis).

    A law with damping pulls the mass back just before that.
    """


class AtZeroForce(AbstractSeparation):
    """The contact ends where the force falls to zero; it never pulls.

    The mass leaves with the stop still indented. The stop has recovered when the mass has left the
    indentation; if the mass turns back before that, contact resumes when the force would push.

    Source: Schwager & Pöschel, Granular Matter 9, 465 (2007).
    """

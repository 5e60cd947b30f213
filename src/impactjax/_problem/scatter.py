"""Restitution that scatters from impact to impact: the choice in an experiment."""

from typing import ClassVar

import equinox as eqx

from impactjax._shown import with_numbers


class AbstractScatter(eqx.Module):
    """A distribution of the speed after each impact around that of the law."""

    scatters: ClassVar[bool]
    """True if a fit estimates the size of the scatter."""

    __repr__ = with_numbers


class NoScatter(AbstractScatter):
    """The same restitution at every impact of one speed."""

    scatters: ClassVar[bool] = False


class NormalScatter(AbstractScatter):
    """The speed after each impact is that of the law times exp(s ξ), with independent standard
    normal ξ. A fit estimates the size s.
    """

    scatters: ClassVar[bool] = True

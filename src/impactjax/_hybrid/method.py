"""The interface of a method of integration."""

import abc

import equinox as eqx

from impactjax._hybrid.step import AbstractFlowStep


class AbstractMethod(eqx.Module):
    """A method that integrates the flow of a mode up to the first event."""

    @abc.abstractmethod
    def of_flows(self) -> AbstractFlowStep:
        """The method as a step of any hybrid system."""

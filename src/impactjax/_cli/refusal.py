"""Errors about the command line."""

from collections.abc import Sequence

from impactjax._compare.named import check_law, check_oscillator


class Refusal(ValueError):  # noqa: N818  it is no error of the program
    """Error about the command line; the message says what is possible instead."""


def check_names(laws: Sequence[str], system: str | None) -> None:
    """Raises `Refusal` for a law or a system that does not exist."""
    try:
        for law in laws:
            check_law(law)
        if system is not None:
            check_oscillator(system)
    except ValueError as error:
        raise Refusal(str(error)) from error

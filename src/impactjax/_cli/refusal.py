"""Errors about the command line."""

from collections.abc import Sequence

from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS


class Refusal(ValueError):  # noqa: N818  it is no error of the program
    """Error about the command line; the message says what is possible instead."""


def check_names(laws: Sequence[str], system: str | None) -> None:
    """Raises `Refusal` for a law or a system that does not exist."""
    for law in laws:
        if law not in (NO_LAW, *LAWS):
            raise Refusal(f"there is no law `{law}`; use one of {NO_LAW}, {', '.join(LAWS)}.")
    if system is not None and system not in OSCILLATORS:
        raise Refusal(f"there is no system `{system}`; use one of {', '.join(OSCILLATORS)}.")

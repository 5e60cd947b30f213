"""Errors about the command line."""

import contextlib
from collections.abc import Iterator, Sequence

import typer

from impactjax._compare.named import check_law, check_oscillator
from impactjax._record.file_error import FileError


class Refusal(ValueError):  # noqa: N818  it is no error of the program
    """Error about the command line; the message says what is possible instead."""


@contextlib.contextmanager
def refusals_told() -> Iterator[None]:
    """Prints a `Refusal` or a `FileError` as one sentence, and ends the command with status 2."""
    try:
        yield
    except (FileError, Refusal) as error:
        typer.echo(f"impactjax: {error}", err=True)
        raise typer.Exit(2) from error


def check_names(laws: Sequence[str], system: str | None) -> None:
    """Raises `Refusal` for a law or a system that does not exist."""
    try:
        for law in laws:
            check_law(law)
        if system is not None:
            check_oscillator(system)
    except ValueError as error:
        raise Refusal(str(error)) from error

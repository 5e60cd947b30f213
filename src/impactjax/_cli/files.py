"""Files that the command writes, and overwrites only on request."""

import os
from collections.abc import Sequence
from pathlib import Path

import typer

from impactjax._cli.refusal import Refusal
from impactjax._report.write import check_absent, write_texts


def write(targets: Sequence[Path], texts: Sequence[str], force: bool) -> None:
    """Writes files and says so. Raises `Refusal` if that is not possible."""
    try:
        write_texts(targets, texts, force)
    except FileExistsError as error:
        raise Refusal(f"{error.filename} exists by now; use another --out.") from error
    except OSError as error:
        folder = targets[0].parent
        raise Refusal(f"{folder} cannot be written to ({error.strerror}).") from error
    typer.echo(f"Written: {', '.join(str(path) for path in targets)}")


def in_folder(out: Path, targets: Sequence[Path], force: bool) -> None:
    """Creates a folder for files. Raises `Refusal` if a file exists, unless `force`."""
    try:
        check_absent(targets, force)
    except FileExistsError as error:
        path = error.filename
        refusal = f"{path} exists; use --force to overwrite it, or another --out."
        raise Refusal(refusal) from error
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Refusal(f"{out} cannot be a folder ({error.strerror}); choose another.") from error
    if not os.access(out, os.W_OK):
        raise Refusal(f"{out} cannot be written to; choose another.")

"""Errors about files, each as one sentence."""

import re
from pathlib import Path

_LONGEST = 200  # problem or remedy, in characters


class FileError(ValueError):
    """Error about a file that cannot be used.

    The message is one sentence with the file, the line if there is one, the problem and the remedy.
    """

    def __init__(self, path: Path, line: int | None, problem: str, remedy: str) -> None:
        place = f"{path}, line {line}" if line is not None else f"{path}"
        self.args = (f"{_printable(place)}: {_brief(problem)}; {_brief(remedy)}.",)


def _brief(text: str) -> str:
    """A text with quotations from the file shortened."""
    quoted = re.sub(r"`([^`]{40})[^`]+`", r"`\1…`", _printable(text))
    return quoted if len(quoted) <= _LONGEST else quoted[:_LONGEST] + "…"


def _printable(text: str) -> str:
    """A text with control characters from the file escaped."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)

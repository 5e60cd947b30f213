"""A file that cannot be used, said in one sentence."""

import re
from pathlib import Path

_LONGEST = 200  # problem or remedy, in characters


class FileError(ValueError):
    """A file cannot be used: what is wrong with it, where, and what to do about it.

    The message is one sentence with the file, the line where there is one, and the remedy.
    """

    def __init__(self, path: Path, line: int | None, problem: str, remedy: str) -> None:
        place = f"{path}, line {line}" if line is not None else f"{path}"
        self.args = (f"{_printable(place)}: {_brief(problem)}; {_brief(remedy)}.",)


def _brief(text: str) -> str:
    """A text whose quotations from the file are short."""
    quoted = re.sub(r"`([^`]{40})[^`]+`", r"`\1…`", _printable(text))
    return quoted if len(quoted) <= _LONGEST else quoted[:_LONGEST] + "…"


def _printable(text: str) -> str:
    """A text that cannot break a line or command a terminal, whatever the file held."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)

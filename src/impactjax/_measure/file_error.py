"""A file that cannot be used, said in one sentence."""

from pathlib import Path


class FileError(ValueError):
    """A file cannot be used: what is wrong with it, where, and what to do about it.

    The message is one sentence with the file, the line where there is one, and the remedy.
    """

    def __init__(self, path: Path, line: int | None, problem: str, remedy: str) -> None:
        place = f"{path}, line {line}" if line is not None else f"{path}"
        self.args = (f"{place}: {problem}; {remedy}.",)

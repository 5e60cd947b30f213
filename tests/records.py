"""Records as text files, a column of times and one of values."""

from collections.abc import Iterable
from pathlib import Path


def table(header: str, times: Iterable[float], values: Iterable[float]) -> str:
    rows = [f"{t}, {x}" for t, x in zip(times, values, strict=True)]
    return "\n".join([header, *rows]) + "\n"


def record_file(
    path: Path, column: str, times: Iterable[float], values: Iterable[float], sidecar: str = ""
) -> Path:
    """Writes a record, times in seconds, and its sidecar; the path of the record."""
    path.write_text(table(f"time [s], {column}", times, values), encoding="utf-8")
    path.with_suffix(".toml").write_text(sidecar, encoding="utf-8")
    return path

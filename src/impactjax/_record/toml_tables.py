"""Tables of a TOML file, checked against their description."""

import difflib
import re
import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec

from impactjax._record.file_error import FileError

_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "float | null": "a number",
    "str | null": "a text",
    "bool | null": "true or false",
    "array | null": "a list",
    "int | str | null": "a whole number or a text",
}
LARGEST = sys.float_info.max
Finite = Annotated[float, msgspec.Meta(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, msgspec.Meta(gt=0, le=LARGEST)]

T = TypeVar("T", bound=msgspec.Struct)


def tables_in(path: Path, text: str, kind: type[T]) -> T:
    """The tables of a TOML file. Raises `FileError` for a key or a value that is not described."""
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also for very long numbers and nested lists
        where = re.search(r"at line (\d+)|at end of document", str(error))
        line = None if where is None else int(where[1] or len(text.splitlines()))
        problem = re.sub(r" \(at .*\)$", "", str(error)).split("; ")[0]
        raise FileError(path, line, f"not valid TOML ({problem})", "mend the syntax") from error
    try:
        return msgspec.convert(tables, kind)
    except msgspec.ValidationError as error:
        raise _explain(path, text, tables, kind, str(error)) from error


def _explain(
    path: Path, text: str, tables: dict[str, Any], kind: type[msgspec.Struct], message: str
) -> FileError:
    """An error of msgspec, in terms of the file."""
    found = re.fullmatch(r"(.*?)(?: - at `\$\.?([^`]*)`)?", message, re.DOTALL)
    assert found is not None
    problem, place = found[1], found[2] or ""
    unknown = re.search(r"unknown field `(.+)`", problem, re.DOTALL)
    if unknown:
        key, allowed = unknown[1], _keys(kind, place)
        close = difflib.get_close_matches(key, allowed, 1)
        hint = f"did you mean `{close[0]}`" if close else f"use one of {', '.join(allowed)}"
        where = f"in [{place}]" if place else "at the top"
        return FileError(path, line_of(text, key), f"unknown key `{key}` {where}", hint)
    if place.endswith("[...]"):
        place = f"{place[:-5]}.{_wrong_entry(tables[place[:-5]])}"
    key = place.split(".")[-1].split("[")[0]
    problem = re.sub(r"[<>]= -?1\.79\S+", "that is finite", problem)
    for technical, word in _WORDS.items():
        problem = problem.replace(f"`{technical}`", word)
    return FileError(
        path, line_of(text, key), f"`{place}` cannot be used ({problem})", "correct its value"
    )


def _keys(kind: type[msgspec.Struct], table: str) -> list[str]:
    own = next((f.type for f in msgspec.structs.fields(kind) if f.name == table), kind)
    return [field.name for field in msgspec.structs.fields(own)]


def _wrong_entry(table: dict[str, Any]) -> str:
    """The first key whose value is not a finite number."""
    for name, value in table.items():
        try:
            msgspec.convert(value, Finite)
        except msgspec.ValidationError:
            return name
    raise AssertionError("msgspec found one")


def line_of(text: str, key: str) -> int | None:
    """The number of the line with a key or table."""
    pattern = re.compile(rf"^\s*\[?\s*[\"']?{re.escape(key)}[\"']?\s*[=\]]")
    for number, line in enumerate(text.splitlines(), start=1):
        if pattern.match(line):
            return number
    return None

"""Tables of a TOML file, checked against their description."""

import difflib
import re
import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

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
    "int | null": "a whole number",
    "int | str | null": "a whole number or a text",
    "object | array": "a table or a list",
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
    if "[...]" in place:
        table = place.split("[")[0]
        entry = _wrong_entry(tables, table, kind, message)
        place = place.replace(f"{table}[...]", f"{table}.{entry}")
    where = f"in [{place}]" if place else "at the top"
    if unknown := re.search(r"unknown field `(.+)`", problem, re.DOTALL):
        key, allowed = unknown[1], _keys(kind, place)
        close = difflib.get_close_matches(key, allowed, 1)
        hint = f"use one of {', '.join(allowed)}" if allowed else "omit it"
        hint = f"did you mean `{close[0]}`" if close else hint
        return FileError(path, line_of(text, key, place), f"unknown key `{key}` {where}", hint)
    table, _, key = place.rpartition(".")
    if lacking := re.search(r"missing required field `(.+)`", problem):
        line = line_of(text, key, table) if key else None
        return FileError(path, line, f"there is no `{lacking[1]}` {where}", "add it")
    table, key = re.sub(r"\[.*", "", table), key.split("[")[0]
    problem = re.sub(r"[<>]= -?1\.79\S+", "that is finite", problem)
    for technical, word in _WORDS.items():
        problem = problem.replace(f"`{technical}`", word)
    line = line_of(text, key, table)
    return FileError(path, line, f"`{place}` cannot be used ({problem})", "correct its value")


def _keys(kind: type[msgspec.Struct], table: str) -> list[str]:
    """The keys of a table of a file, or of the file itself; none where tables have other tables."""
    types = {field.name: field.type for field in msgspec.structs.fields(kind)}
    own = types.get(table) if table else kind
    for each in (own, *get_args(own)):  # a table that may be absent is a union
        if isinstance(each, type) and issubclass(each, msgspec.Struct):
            return [field.name for field in msgspec.structs.fields(each)]
    return []


def _wrong_entry(
    tables: dict[str, Any], table: str, kind: type[msgspec.Struct], message: str
) -> str:
    """The first key of a table with whose value alone msgspec says the same."""
    for name, value in tables[table].items():
        try:
            msgspec.convert({**tables, table: {name: value}}, kind)
        except msgspec.ValidationError as error:
            if str(error) == message:
                return name
    raise AssertionError("msgspec found one")


def line_of(text: str, key: str, table: str = "") -> int | None:
    """The number of the line with a key or table; with a key of one table if that has a header."""
    pattern = re.compile(rf"^\s*\[*\s*[\"']?{re.escape(key)}[\"']?\s*[=\]]")
    header = re.compile(rf"^\s*\[+\s*{re.escape(table)}\s*\]")
    lines = text.splitlines()
    inside = everywhere = not table or not any(map(header.match, lines))
    for number, line in enumerate(lines, start=1):
        if not everywhere and line.lstrip().startswith("["):
            inside = bool(header.match(line))
        if inside and pattern.match(line):
            return number
    return None

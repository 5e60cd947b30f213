"""Makes the page of public names: `python docs/api.py`."""

import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import impactjax

HERE = Path(__file__).parent
SOURCE = Path(impactjax.__file__).parent

TOPICS = {
    "Models": ("_model",),
    "Simulation": ("_simulate", "_results"),
    "Approximations in closed form": ("_analytic",),
    "Sensors and recordings": ("_sensor", "_record", "_first_look"),
    "Fitting": ("_problem", "_optimise", "_fit"),
    "A look at a recording": ("_check",),
    "Comparison of laws": ("_compare",),
    "Identifiability": ("_identify",),
    "Forced response": ("_response",),
    "Studies": ("_study",),
    "Reports and figures": ("_report",),
    "Parameters of your own classes": ("_parameter",),
}
"""Topics in the order of the page, each with its private packages; other names come last."""

HEAD = """# Public names

What `import impactjax as ij` offers, with the first sentence of each docstring and a link to its
source. The whole docstring: `help(impactjax.simulate)`. `python docs/api.py` makes this page.
"""


def page() -> str:
    """The whole page: topics of the top level, then a section for each public namespace."""
    names = dict(public(impactjax))
    sections = [HEAD]
    for topic in [*TOPICS, "Other"]:
        members = {name: value for name, value in names.items() if topic_of(value) == topic}
        sections += [section(topic, members)] if members else []
    for name, space in namespaces(impactjax):
        own = {key: value for key, value in public(space) if names.get(key) is not value}
        sections.append(f"## `ij.{name}`\n\n{sentence(space)}\n\n{table(own)}")
    return "\n".join(sections)


def public(space: ModuleType) -> Iterator[tuple[str, object]]:
    """The names that a module offers, other modules left out."""
    for name in getattr(space, "__all__", None) or dir(space):
        value = getattr(space, name)
        if not name.startswith("_") and not inspect.ismodule(value) and is_ours(value):
            yield name, value


def namespaces(space: ModuleType) -> Iterator[tuple[str, ModuleType]]:
    """The modules of this package that a module offers."""
    for name in dir(space):
        value = getattr(space, name)
        if not name.startswith("_") and inspect.ismodule(value) and is_ours(value):
            yield name, value


def is_ours(value: object) -> bool:
    """Is it a module, class or function of this package, or a value without a module: a table?"""
    home = value.__name__ if inspect.ismodule(value) else getattr(value, "__module__", None)
    return home is None or home.split(".")[0] == "impactjax"


def topic_of(value: object) -> str:
    """The topic whose private package holds a class or function."""
    parts = getattr(value, "__module__", "").split(".")
    for topic, packages in TOPICS.items():
        if set(packages) & set(parts[1:2]):
            return topic
    return "Other"


def section(title: str, members: dict[str, object]) -> str:
    """A heading and its table."""
    return f"## {title}\n\n{table(members)}"


def table(members: dict[str, object]) -> str:
    """One row a name, in alphabetical order without regard to capitals."""
    rows = ["| name | what it is |", "|---|---|"]
    for name in sorted(members, key=str.lower):
        rows.append(f"| {link(name, members[name])} | {sentence(members[name])} |")
    return "\n".join(rows) + "\n"


def link(name: str, value: object) -> str:
    """The name, with a link to the file that defines it if there is one."""
    module = sys.modules.get(getattr(value, "__module__", ""))
    if module is None or module.__file__ is None:
        return f"`{name}`"
    path = Path(module.__file__).relative_to(SOURCE).as_posix()
    return f"[`{name}`](../src/impactjax/{path})"


def sentence(value: object) -> str:
    """The first sentence of a docstring, fit for a cell of a table."""
    if not (inspect.ismodule(value) or callable(value)):
        return f"`{type(value).__name__}`"
    paragraph = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split())
    first = re.match(r".*?[^.]\.(?=\s+[A-Z`]|$)", paragraph)
    said = first[0] if first else paragraph.rstrip(":.") + "."
    return said.replace("|", r"\|")


if __name__ == "__main__":
    (HERE / "api.md").write_text(page())

"""The page of public names is what `docs/api.py` makes of the code."""

import runpy
from pathlib import Path
from types import ModuleType

import impactjax
from tiers import quick

pytestmark = quick

DOCS = Path(__file__).parent.parent / "docs"
API = runpy.run_path(str(DOCS / "api.py"))


def test_page_is_up_to_date():
    assert (DOCS / "api.md").read_text() == API["page"](), "run `python docs/api.py`"


def test_page_has_every_public_name():
    page = (DOCS / "api.md").read_text()
    for space in (impactjax, *(space for _, space in API["namespaces"](impactjax))):
        for name, _ in API["public"](space):
            assert f"`{name}`" in page, name


def test_topics_name_packages_that_exist():
    homes = {path.stem for path in API["SOURCE"].iterdir()}
    assert {package for packages in API["TOPICS"].values() for package in packages} <= homes


def test_first_sentences():
    def said(text: str) -> str:
        space = ModuleType("space", text)
        return API["sentence"](space)

    assert said("A law of\ncontact. And more.\n\nEven more.") == "A law of contact."
    assert (
        said("A gap of 0.5 mm, e.g. of a stop: `x | y`.")
        == r"A gap of 0.5 mm, e.g. of a stop: `x \| y`."
    )
    assert said("No full stop:\n\nMore.") == "No full stop."


def test_names_of_a_namespace_are_listed_once(monkeypatch):
    space = ModuleType("impactjax.plot", "Figures as functions of an axes.")
    drawing = type("draw", (), {"__doc__": "A drawing.", "__module__": "impactjax.plot"})
    vars(space).update(simulate=impactjax.simulate, draw=drawing)  # the first is public at the top
    monkeypatch.setattr(impactjax, "plot", space, raising=False)
    section = API["page"]().split("## `ij.plot`\n")[1].split("\n## ")[0]
    assert section.count("| A drawing. |") == 1
    assert "`simulate`" not in section

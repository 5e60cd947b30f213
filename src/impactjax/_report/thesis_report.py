"""Report on the thesis: content of `thesis.json`, and a page."""

import collections
import json
from collections.abc import Mapping, Sequence

from impactjax._report.rendered import rendered
from impactjax._report.versions import versions
from impactjax._thesis.claim import Claim, Verdict
from impactjax._thesis.figures import FIGURES

_TITLE = "Contact modeling for a nonlinear impact oscillator, recomputed"


def thesis_texts(claims: Mapping[str, Sequence[Claim]], command: str) -> tuple[str, str]:
    """The content of `thesis.json` and the page.

    **Arguments:**

    - `claims`: the claims beside each figure, by its number.
    - `command`: command to quote in the page.
    """
    content = json.dumps(_document(claims), indent=2, ensure_ascii=False)
    page = rendered(
        "thesis.html",
        title=_TITLE,
        counts=counts([claim for each in claims.values() for claim in each]),
        figures=[
            (number, FIGURES[number].title, picture_name(number), each)
            for number, each in claims.items()
        ],
        command=command,
        seed=None,
    )
    return f"{content}\n", page


def picture_name(number: str) -> str:
    """Name of the file with a figure."""
    return f"figure-{number}.png"


def counts(claims: Sequence[Claim]) -> dict[str, int]:
    """Number of claims with each verdict."""
    found = collections.Counter(claim.verdict for claim in claims)
    return {str(verdict): found[verdict] for verdict in Verdict}


def _document(claims: Mapping[str, Sequence[Claim]]) -> dict[str, object]:
    figures = {
        number: {
            "title": FIGURES[number].title,
            "picture": picture_name(number),
            "claims": [claim._asdict() for claim in each],
        }
        for number, each in claims.items()
    }
    return {"figures": figures, "versions": versions()}

"""Makes the table and the figures of the page on the thesis: `python docs/thesis.py`."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import jax

from impactjax._thesis.claim import Claim
from impactjax._thesis.figures import FIGURES

HERE = Path(__file__).parent
PICTURES = ("3.6", "4.3-1hz", "4.9")
BEGIN, END = "<!-- table -->\n", "<!-- end of the table -->\n"


def main() -> None:
    """Writes the table into the page, and some of the pictures."""
    jax.config.update("jax_enable_x64", True)
    claims = {}
    for number, figure in FIGURES.items():
        made = figure.make()
        claims[number] = made.claims
        if number in PICTURES:
            made.picture.savefig(HERE / "figures" / f"thesis-{number}.png", dpi=110)
    page = HERE / "thesis.md"
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    after = rest.split(END)[1]
    page.write_text("".join([before, BEGIN, table(claims), END, after]), encoding="utf-8")


def table(claims: Mapping[str, Sequence[Claim]]) -> str:
    """The claims as a table in Markdown."""
    lines = ["| figure | claim | thesis | computed | verdict |", "|---|---|---|---|---|"]
    for claim in (claim for each in claims.values() for claim in each):
        lines.append("| " + " | ".join(cell.replace("|", r"\|") for cell in claim.row()) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()

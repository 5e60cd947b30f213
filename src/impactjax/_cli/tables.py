"""Tables and sentences that the command prints."""

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from impactjax._compare.comparison import Comparison
from impactjax._compare.repeatability import Repeatability
from impactjax._report.repeats import repeat_rows
from impactjax._report.rows import parameter_rows
from impactjax._report.words import sentences

_WIDTH = 120  # columns of a table that is not printed on a terminal
_FITS = "law", "rms", "parameter", "value ± standard error", "95 % interval", "verdict"
_REPEATS = "law", "behind", "parameter", "mean ± standard error", "95 % interval"
_BETWEEN = "between repeats", "a single repeat", "recordings"

Section = Iterable[Sequence[str]]


def print_fits(comparison: Comparison, printed: Sequence[str]) -> None:
    """Prints table and sentences. Notes that were `printed` before the fit are not repeated."""
    fits = comparison.fits
    unit, factor = comparison.best.estimate.problem.recording.shown
    sections = []
    for fitted, rows in zip(fits, parameter_rows(fits), strict=True):
        shown, section = [fitted.name, f"{float(fitted.estimate.rms) * factor:.4g} {unit}"], []
        for row in rows:
            value, verdict = f"{row['value']} {row['unit']}", f"{row['verdict']}{row['given']}"
            section.append([*shown, row["name"], value.rstrip(), row["interval"], verdict])
            shown = ["", ""]
        sections.append(section)
    notes = [note for note in comparison.notes if note not in printed]
    _print(comparison.name, _FITS, sections, [*notes, *sentences(fits)])


def print_repeats(repeats: Repeatability) -> None:
    """Prints means over repeats and the scatter between them."""
    sections = []
    for model in repeats.models:
        shown, section = [model.name, f"{model.behind:.1f}"], []
        for row in repeat_rows(model):
            value = f"{row['value']} {row['unit']}".rstrip()
            last = [row["interval"], row["between"], row["single"], row["count"]]
            section.append([*shown, row["name"], value, *last])
            shown = ["", ""]
        sections.append(section)
    _print("all recordings together", (*_REPEATS, *_BETWEEN), sections, repeats.notes)


def _print(
    title: str, headings: Sequence[str], sections: Iterable[Section], said: Iterable[str]
) -> None:
    console = Console()
    table = Table(title=escape(title), title_justify="left", title_style="bold")
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    for section in sections:
        for row in section:
            table.add_row(*row)
        table.add_section()
    if not console.is_terminal:
        endless = console.options.update(width=10 * _WIDTH)
        console.width = max(_WIDTH, Measurement.get(console, endless, table).maximum)
    console.print(table)
    if not console.is_terminal:
        console.width = _WIDTH
    for sentence in said:
        console.print(f"- {sentence}", highlight=False, markup=False)
    console.print()

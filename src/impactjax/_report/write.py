"""Writer of reports."""

import errno
import json
import os
from collections.abc import Sequence
from pathlib import Path

from impactjax._compare.comparison import Comparison
from impactjax._compare.repeatability import Repeatability
from impactjax._refusal import check_kind
from impactjax._report.document import document
from impactjax._report.page import page
from impactjax._report.profile_curves import best_curves

_FILES = ("fit.json", "report.html")
_DESIGN_FILES = ("design.json", "design.html")


def write_report(
    folder: str | Path,
    results: Comparison | Sequence[Comparison] | Repeatability,
    *,
    command: str = "impactjax.io.write_report",
    profiles: bool = False,
    force: bool = False,
) -> tuple[Path, ...]:
    """Writes `fit.json` and `report.html` for results of `compare` or `repeatability`, and returns
    their paths.

    Both are computed before either is written.

    **Arguments:**

    - `folder`: created if it does not exist.
    - `results`: the comparison of one recording, those of several, or the result of
      `repeatability`, whose means come first.
    - `command`: command to quote in the report.
    - `profiles`: true for profile likelihoods of the best fit, which take a few seconds.
    - `force`: true to overwrite files.

    **Raises** `FileExistsError` for files that exist, unless `force`, `TypeError` for other
    results, and `ValueError` for none.
    """
    repeats = results if isinstance(results, Repeatability) else None
    several = _comparisons(results)
    targets = report_files(Path(folder))
    check_absent(targets, force)
    texts = report_texts(several, command, repeats, profiles)
    Path(folder).mkdir(parents=True, exist_ok=True)
    write_texts(targets, texts, force)
    return targets


def _comparisons(
    results: Comparison | Sequence[Comparison] | Repeatability,
) -> Sequence[Comparison]:
    if isinstance(results, Repeatability):
        return results.comparisons
    several = [results] if isinstance(results, Comparison) else [*results]
    for each in several:
        check_kind("results", each, Comparison, "compare(prepare(file))")
    if not several:
        raise ValueError("There is no comparison to report.")
    return several


def report_files(folder: Path) -> tuple[Path, ...]:
    """The paths of a report's files in a folder."""
    return tuple(folder / name for name in _FILES)


def design_files(folder: Path) -> tuple[Path, ...]:
    """The paths of the files of a design in a folder."""
    return tuple(folder / name for name in _DESIGN_FILES)


def check_absent(targets: Sequence[Path], force: bool) -> None:
    """Raises `FileExistsError` for a file that exists, unless `force`."""
    for target in targets:
        if os.path.lexists(target) and not force:
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))


def report_texts(
    comparisons: Sequence[Comparison],
    command: str,
    repeats: Repeatability | None = None,
    profiles: bool = False,
) -> tuple[str, ...]:
    """The content of each file of a report, with or without profiles of the best fits."""
    curves = best_curves(comparisons) if profiles else {}
    content = json.dumps(document(comparisons, repeats, curves), indent=2)
    return f"{content}\n", page(comparisons, command, repeats, curves)


def write_texts(targets: Sequence[Path], texts: Sequence[str], force: bool) -> None:
    """Writes files. Without `force`, a file that was created in the meantime is not overwritten."""
    for target, text in zip(targets, texts, strict=True):
        with target.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)

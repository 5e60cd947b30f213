"""Thousands of random runs of the package beside those of an independent simulator.

    python -m benchmarks.fuzz [--runs 1000] [--seed 1] [--only NAME] [--json FILE] [--values]

Prints a table in Markdown: for each class of systems how many runs agree, how many do not, which
are too ill-conditioned to tell, which are refused and why, and the largest errors in units of what
is allowed. Ends with status 1 if any run is wrong.
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[2] / ".jax_cache"))
os.environ.setdefault("EQX_ON_ERROR", "nan")

import jax
from rich.console import Console
from rich.progress import Progress

from .campaign import campaign
from .classes import CLASSES
from .compare import Verdict


def _row(name: str, verdicts: list[Verdict]) -> str:
    kinds = Counter(each.kind for each in verdicts)
    fine = [each for each in verdicts if each.kind in ("right", "wrong")]
    others = {k: v for k, v in kinds.items() if k not in ("right", "wrong", "ill-conditioned")}
    said = ", ".join(f"{v} {k}" for k, v in sorted(others.items()))

    parts = Counter(part for each in verdicts for part in each.wrong or {})
    wrong = ", ".join(f"{v} {k}" for k, v in parts.most_common())

    def worst(column: str) -> str:
        numbers = [getattr(each, column) for each in fine if each.kind == "right"]
        return f"{max(numbers, default=0):.2g}"

    return (
        f"| {name} | {len(verdicts)} | {kinds['right']} | {kinds['wrong']} | {wrong} | "
        f"{kinds['ill-conditioned']} | {said} | {worst('value')} | {worst('gradient')} | "
        f"{worst('reverse')} |"
    )


HEAD = (
    "| class | runs | right | wrong | what | ill-conditioned | not compared | value | derivative | "
    "reverse |\n|---|---|---|---|---|---|---|---|---|---|"
)


def main() -> int:
    """Fuzz and print."""
    parser = argparse.ArgumentParser(
        description="Runs of the package beside those of an independent simulator."
    )
    parser.add_argument("--runs", type=int, default=1000, help="a class")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", help="classes whose name contains this")
    parser.add_argument("--values", action="store_true", help="no derivatives")
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--json", type=Path, help="write all runs that are not right to this file")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    wanted = arguments.only or [""]
    names = [name for name in CLASSES if any(part in name for part in wanted)]
    rows, cases, wrong = [], [], 0
    with Progress(console=Console(stderr=True, width=200)) as progress:
        for name in names:
            began = time.perf_counter()
            runs = campaign(
                name,
                arguments.runs,
                arguments.seed,
                arguments.tolerance,
                values_only=arguments.values,
            )
            found = list(progress.track(runs, total=arguments.runs, description=name))
            rows.append(_row(name, [verdict for _, verdict in found]))
            progress.console.print(f"{rows[-1]} {time.perf_counter() - began:.0f} s", markup=False)
            for number, (drawn, verdict) in enumerate(found):
                wrong += verdict.kind == "wrong"
                if verdict.kind != "right":
                    cases.append(
                        {
                            "class": name,
                            "number": number,
                            **verdict._asdict(),
                            "parameters": drawn.parameters.tolist(),
                            "times": drawn.times.tolist(),
                            "direction": drawn.direction.tolist(),
                        }
                    )
            if arguments.json is not None:
                arguments.json.write_text(json.dumps(cases, indent=1))
            jax.clear_caches()
    print("\n".join([HEAD, *rows]))
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())

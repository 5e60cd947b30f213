"""Checks of a page in a real browser."""

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium on the PATH")

_LOOK = """<script>
addEventListener("load", () => {
  const widths = [...document.images].map(image => image.naturalWidth);
  const page = document.documentElement;
  page.dataset.images = JSON.stringify(widths);
  page.dataset.overflow = Math.max(0, page.scrollWidth - page.clientWidth);
});
</script></body>"""


class Look(NamedTuple):
    """Widths of the images (0 if missing), words on the console, and pixels too wide."""

    images: list[int]
    console: list[str]
    overflow: int
    dom: str


def look(page: str, folder: Path, width: int = 1000) -> Look:
    """Opens a page in a headless browser that reaches no other machine."""
    assert CHROMIUM is not None
    path = folder / "page.html"
    path.write_text(page.replace("</body>", _LOOK), encoding="utf-8")
    run = subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--virtual-time-budget=5000",
            f"--window-size={width},800",
            f"--user-data-dir={folder / 'profile'}",
            *(["--no-sandbox"] if os.geteuid() == 0 else []),
            "--dump-dom",
            path.as_uri(),
        ],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    found = dict(re.findall(r'data-(images|overflow)="([^"]*)"', run.stdout))
    images = [int(width) for width in re.findall(r"\d+", found["images"])]
    console = re.findall(r"CONSOLE.*", run.stderr)
    return Look(images, console, int(found["overflow"]), run.stdout)

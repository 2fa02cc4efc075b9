"""Draws docs/img again: the examples as `irsim show` draws them, the sheets of `irsim gallery`, and the head of the
report of `make demo`. `make pictures` runs it."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from PIL import Image

from irsim.draw import contact_sheet
from irsim.loader import examples
from irsim.sheets import SHEETS
from irsim.sources import open_source

DOCS = Path(__file__).parent
IMAGES = DOCS / "img"
WIDTH, COLOURS = 960, 128
"""Of the pictures: small enough to be kept in git."""


def report_head(shot: Path) -> None:
    """The report as a browser shows its first screen."""
    report = (DOCS.parent / "report.html").as_uri()
    with tempfile.TemporaryDirectory() as profile:
        browser = ["chromium", "--headless", "--no-sandbox", "--hide-scrollbars", f"--user-data-dir={profile}"]
        subprocess.run([*browser, "--window-size=1100,1265", f"--screenshot={shot}", report], check=True)


def make_small(path: Path) -> None:
    with Image.open(path) as picture:
        picture.thumbnail((WIDTH, 4 * WIDTH))
        small = picture.convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        small.save(path, optimize=True)


def main() -> None:
    for word, write in SHEETS.items():
        write(IMAGES / f"all-{word}.png")
    for name in examples():
        contact_sheet(open_source(name), IMAGES / f"{name}.png")
    report_head(IMAGES / "report.png")
    for path in IMAGES.glob("*.png"):
        make_small(path)


if __name__ == "__main__":
    main()

"""Draws docs/img again: the examples as `irsim show` draws them, the sheets of `irsim gallery`, tracks of `swarm`, and
the head of the report of `make demo`. `make pictures` runs it."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from irsim.cli.figures import contact_sheet
from irsim.cli.gallery import SHEETS
from irsim.render.sources import open_source
from irsim.scenario.catalog import examples
from irtrack.replay.many import run_many
from irtrack.report.line_styles import HUES

DOCS = Path(__file__).parent
IMAGES = DOCS / "img"
WIDTH = 960
"""Of the pictures, px: small enough to be kept in git, as are those of so few greys and colours."""
GREYS, COLOURS = 56, 40
TRACK_COLOURS = (*HUES, "#f0e442")
COLOURED = 24
"""Pixels whose channels lie farther apart are no greys."""


def report_head(shot: Path) -> None:
    """The report as a browser shows its first screen."""
    report = (DOCS.parent / "report.html").as_uri()
    with tempfile.TemporaryDirectory() as profile:
        browser = ["chromium", "--headless", "--no-sandbox", "--hide-scrollbars", f"--user-data-dir={profile}"]
        subprocess.run([*browser, "--window-size=1100,1265", f"--screenshot={shot}", report], check=True)


TRACKED_FRAME, ENLARGED = 90, 3
"""Frame of the picture of tracks, and its enlargement."""


def tracked_swarm(out: Path) -> None:
    """The tracks of `gnn` on `swarm` from frame 0 without a box: their paths, and their boxes in the last frame."""
    source = open_source("swarm")
    tracks = run_many("gnn", source, input="counts", frames=TRACKED_FRAME + 1)
    image = Image.fromarray(source.frame(TRACKED_FRAME, "display").image).convert("RGB")
    picture = image.resize((ENLARGED * image.width, ENLARGED * image.height), Image.Resampling.BICUBIC)
    pen = ImageDraw.Draw(picture)
    for place, id in enumerate(np.unique(tracks.id[tracks.confirmed]).tolist()):
        rows = np.flatnonzero(tracks.confirmed & (tracks.id == id))
        path = ENLARGED * (np.column_stack([tracks.cx[rows], tracks.cy[rows]]) + 0.5)
        color = TRACK_COLOURS[place % len(TRACK_COLOURS)]
        pen.line([tuple(point) for point in path.tolist()], fill=color, width=2)
        if tracks.frame[rows[-1]] == TRACKED_FRAME:
            (x, y), half = path[-1], ENLARGED * np.maximum([tracks.w[rows[-1]], tracks.h[rows[-1]]], 8) / 2
            pen.rectangle((x - half[0], y - half[1], x + half[0], y + half[1]), outline=color, width=2)
            pen.text((x + half[0] + 4, y - half[1] - 4), str(id), fill=color, font_size=18)
    picture.save(out)


def make_small(path: Path) -> None:
    with Image.open(path) as picture:
        picture.thumbnail((WIDTH, 4 * WIDTH))
        whole = picture.convert("RGB")
    palette = Image.new("P", (1, 1))
    palette.putpalette([*np.linspace(0, 255, GREYS).round().astype(np.uint8).repeat(3).tolist(), *_colours(whole)])
    whole.quantize(palette=palette, dither=Image.Dither.NONE).save(path, optimize=True)


def _colours(picture: Image.Image) -> list[int]:
    """Red, green and blue of the colours that stand for all that are no greys: few pixels, such as boxes and names,
    which a palette of the whole picture leaves out."""
    pixels = np.asarray(picture).reshape(-1, 3)
    coloured = pixels[np.ptp(pixels, axis=1) > COLOURED]
    if not len(coloured):
        return []
    return Image.fromarray(coloured[None]).quantize(COLOURS, Image.Quantize.MEDIANCUT).getpalette() or []


def main() -> None:
    for word, write in SHEETS.items():
        write(IMAGES / f"all-{word}.png")
    for name in examples():
        contact_sheet(open_source(name), IMAGES / f"{name}.png")
    tracked_swarm(IMAGES / "tracked.png")
    report_head(IMAGES / "report.png")
    for path in IMAGES.glob("*.png"):
        make_small(path)


if __name__ == "__main__":
    main()

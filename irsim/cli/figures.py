"""Pictures of a source: the one room of irsim that knows matplotlib."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from irsim.config.paths import path_of
from irsim.errors import counted
from irsim.recording.output import atomic_file, check_output
from irsim.types import Box, Frame, Image, Source, Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS_PER_IN = 72
WHOLE = (0, 255)
"""Greys of a picture for people."""
SHEET = 12
"""Frames on a sheet at most."""
COLUMNS = 4
CELL_IN = 3.6
"""Width of a frame on the sheet, inches."""
LARGER = 2
"""Frames are drawn so much larger at most where few of them share the sheet."""
TITLE_LETTERS_PER_IN = 14
TRUTH_COLOR = "#ffb000"  # legible on black, grey and white; told apart by the colour-blind too
ZOOM_PX = 32
"""Least side of the enlarged part, px."""
ZOOM_SHARE = 0.3
"""Height of that part on the sheet, as a share of the picture's."""
NAME_PT = 7
"""Size of targets' names, points."""
NARROWED = 1.05
"""A frame is drawn narrower than its cell of the sheet by up to so much, so that names are that much larger in it."""
HIGHLIGHT = 97.0
"""Percentile of the counts in a target's box, or around it where that is more, that is drawn white where it is
enlarged: what is hotter, an engine, hides nothing of the body."""
MARGIN_PX = 6.0
"""Boxes are drawn larger by this, or they would hide what they show."""


def sheet_indices(count: int, most: int = SHEET) -> list[int]:
    """Frames spread evenly from the first to the last."""
    return sorted({round(float(at)) for at in np.linspace(0, count - 1, min(count, most))})


def contact_sheet(source: Source, path: str | Path, start: int = 0, stop: int | None = None) -> Path:
    """Draw frames of a source, spread evenly over start .. stop-1, as a PNG file and return its path.

    Each frame has its number and time, its targets' boxes, and an enlarged part around the target
    that is followed, whose own counts are drawn from black to white. Where all the frames together leave half
    of the greys unused, what they use is drawn from black to white, and the title says so.
    InputError where the file cannot be written, or is one that the source is read from.
    """
    from matplotlib.figure import Figure

    path = path_of(path)
    check_output(path, *source.needs)
    indices = [start + index for index in sheet_indices((len(source) if stop is None else stop) - start)]
    columns, rows = min(COLUMNS, len(indices)), -(-len(indices) // COLUMNS)
    width, height = source.size
    cell = CELL_IN * min(COLUMNS / columns, LARGER)
    figure = Figure(figsize=(cell * columns, (cell * height / width + 0.12) * rows + 0.5), layout="constrained")
    frames = [source.frame(index, "display") for index in indices]
    black, white = greys = drawn_greys([frame.image for frame in frames])
    facts = f"{width} x {height} px, {source.bits} bits, {counted(len(source), 'frame')} at {source.rate_hz:g} Hz"
    boxes = "; boxes: truth, dotted where more than half is hidden; what is enlarged has greys of its own"
    key = boxes if source.has_truth else "; no truth"
    stretched = "" if greys == WHOLE else f"; greys {black} to {white} drawn from black to white"
    title = fill(f"{source.name}: {facts}{key}{stretched}", int(TITLE_LETTERS_PER_IN * cell * columns))
    figure.suptitle(title, fontsize=9)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, frame in zip(grid.flat, frames, strict=False):
        truth = next(iter(source.truths(frame.index, frame.index + 1)), None)
        taken = _draw_frame(axes, frame, truth, greys, NARROWED * width / (cell * POINTS_PER_IN))
        followed = truth.target(source.follow) if truth is not None and source.follow is not None else None
        if followed is not None and followed.in_view is not False:
            _draw_zoom(axes, source.frame(frame.index).image, followed.box, taken)
    with atomic_file(path) as file:
        figure.savefig(file, format="png", dpi=110)
    return path


def drawn_greys(images: Sequence[Image]) -> tuple[int, int]:
    """The greys to draw as black and as white: `WHOLE`, or where less than half of them are used, the ends of those."""
    low, high = min(int(image.min()) for image in images), max(int(image.max()) for image in images)
    return (low, high) if 0 < high - low < (WHOLE[1] - WHOLE[0]) / 2 else WHOLE


@dataclass(frozen=True, eq=False)
class Labelled:
    """A picture (rows, cols) uint8, what it is called, and a part of it to be enlarged."""

    label: str
    image: Image
    part: Box | None = None


def labelled_sheet(pictures: Sequence[Labelled], path: str | Path, columns: int = COLUMNS) -> Path:
    """Draw pictures side by side, each under its label, as a PNG file and return its path."""
    from matplotlib.figure import Figure

    path = path_of(path)
    rows = -(-len(pictures) // columns)
    height, width = pictures[0].image.shape
    figure = Figure(figsize=(CELL_IN * columns, (CELL_IN * height / width + 0.12) * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, picture in zip(grid.flat, pictures, strict=False):
        axes.imshow(picture.image, cmap="gray", vmin=WHOLE[0], vmax=WHOLE[1], interpolation="nearest")
        axes.set_title(picture.label, fontsize=9, pad=2)
        if picture.part is not None:
            _draw_box(axes, picture.part, hidden=False)
            _draw_zoom(axes, picture.image, picture.part, [])
    with atomic_file(path) as file:
        figure.savefig(file, format="png", dpi=110)
    return path


def _draw_frame(axes: Axes, frame: Frame, truth: Truth | None, greys: tuple[int, int], px_per_pt: float) -> list[Box]:
    """A frame with its targets' boxes and names; what these take."""
    from matplotlib.patheffects import withStroke

    rows, columns = frame.image.shape
    axes.imshow(frame.image, cmap="gray", vmin=greys[0], vmax=greys[1], interpolation="nearest")
    axes.set_title(f"frame {frame.index}, {frame.time:.2f} s", fontsize=8, pad=2)
    axes.autoscale(False)
    taken: list[Box] = []
    names: list[Box] = []
    for target in truth.targets if truth is not None else ():
        box = Box(target.box.cx, target.box.cy, target.box.w + MARGIN_PX, target.box.h + MARGIN_PX)
        _draw_box(axes, box, target.hidden)
        name = shortened(target.id, columns / px_per_pt)
        wide, high = (px_per_pt * points for points in _extent(name))
        left, bottom = name_place(box, (wide, high), (columns, rows), names)
        names.append(Box.from_edges(left, bottom - high, left + wide, bottom))
        taken += [target.box, names[-1]]
        axes.text(
            left,
            bottom,
            name,
            color=TRUTH_COLOR,
            fontsize=NAME_PT,
            va="bottom",
            clip_on=True,
            path_effects=[withStroke(linewidth=1.5, foreground="black")],
        )
    return taken


def _draw_box(axes: Axes, box: Box, hidden: bool) -> None:
    from matplotlib.patches import Rectangle

    axes.add_patch(
        Rectangle(
            (box.left, box.top),
            box.w,
            box.h,
            fill=False,
            edgecolor=TRUTH_COLOR,
            linewidth=0.8,
            linestyle=":" if hidden else "-",
        )
    )


def name_place(
    box: Box, extent: tuple[float, float], size: tuple[int, int], names: Sequence[Box] = ()
) -> tuple[float, float]:
    """Lower left corner, px, of a name of that extent (width, height), within a picture of `size` (columns, rows) while
    any of the box is in it: above its box, or where other names stand there already, below or beside it. Where there is
    no room above, it is below, or else in it."""
    (wide, high), (columns, rows) = extent, size
    left = min(max(box.left, 0.0), box.right)
    if box.left < columns:
        left = min(left, max(columns - wide, 0.0))
    above, below, middle = box.top - 1, box.bottom + 1 + high, box.cy + high / 2
    if box.bottom < 0 or above - high >= 0:
        first = left, above
    else:
        first = left, below if below <= rows else max(box.top, 0.0) + 1 + high
    others = (left, below), (box.right + 1, middle), (box.left - 1 - wide, middle)
    inside = [(x, y) for x, y in others if x >= 0 and x + wide <= columns and high <= y <= rows]
    return min([first, *inside], key=lambda place: _covered(place, extent, names))


def _covered(place: tuple[float, float], extent: tuple[float, float], names: Sequence[Box]) -> float:
    """How much, px2, a name at a place (its lower left corner) would cover of other names."""
    (left, bottom), (wide, high) = place, extent
    across = (max(min(left + wide, name.right) - max(left, name.left), 0.0) for name in names)
    down = (max(min(bottom, name.bottom) - max(bottom - high, name.top), 0.0) for name in names)
    return sum(x * y for x, y in zip(across, down, strict=True))


def shortened(name: str, most_pt: float) -> str:
    """The name, or as much of it as is no wider than so many points, its middle left out."""
    kept = len(name)
    short = name
    while _extent(short)[0] > most_pt and kept > 2:
        kept -= 1
        short = f"{name[: (kept + 1) // 2]}…{name[len(name) - kept // 2 :]}"
    return short


def _extent(name: str) -> tuple[float, float]:
    """Width of a name, and height of a line, points."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0, 0), name, size=NAME_PT).get_extents().x1), 1.2 * NAME_PT


def zoom_corner(box: Box, taken: Sequence[Box], size: tuple[int, int]) -> tuple[float, float]:
    """Lower left corner, as shares of the axes, of the enlarged part of a picture of `size` (columns, rows).

    It stands in the corner that hides the fewest of what is `taken` (boxes of targets, their names) and of `box`
    itself, of these in the farthest from `box`.
    """
    columns, rows = size
    width, height = ZOOM_SHARE * rows, ZOOM_SHARE * rows
    best: tuple[int, float] | None = None
    chosen = (0.0, 0.0)
    for left in (0.0, columns - width):
        for top in (0.0, rows - height):
            hidden = sum(
                left < other.right + MARGIN_PX
                and other.left - MARGIN_PX < left + width
                and top < other.bottom + MARGIN_PX
                and other.top - MARGIN_PX < top + height
                for other in [box, *taken]
            )
            near = -math.hypot(left + width / 2 - box.cx, top + height / 2 - box.cy)
            if best is None or (hidden, near) < best:
                best, chosen = (hidden, near), (left / columns, 1 - (top + height) / rows)
    return chosen


def zoom_side(box: Box, size: tuple[int, int]) -> int | None:
    """Side, px, of the part around a box that is enlarged in a picture of `size`; None where nothing would be."""
    columns, rows = size
    side = max(ZOOM_PX, 2 * round(max(box.w, box.h)))
    return side if side < min(ZOOM_SHARE * rows, columns) else None


def _within(image: Image, box: Box) -> Image:
    """The pixels of a picture that a box meets, one at least."""
    (left, top, right, bottom), (rows, columns) = box.edges, image.shape
    x, y = (min(max(round(at), 0), most - 1) for at, most in ((left, columns), (top, rows)))
    return image[y : max(round(bottom) + 1, y + 1), x : max(round(right) + 1, x + 1)]


def _draw_zoom(axes: Axes, image: Image, box: Box, taken: Sequence[Box]) -> None:
    """An enlarged part around a box, in the corner where it hides least; none where it would show the box smaller than
    the picture does. Its greys are its own: where a picture shows a hot body as one white spot, its parts are seen."""
    rows, columns = image.shape
    side = zoom_side(box, (columns, rows))
    if side is None:
        return
    left = min(max(round(box.cx - side / 2), 0), columns - side)
    top = min(max(round(box.cy - side / 2), 0), rows - side)
    part = image[top : top + side, left : left + side]
    zoom = axes.inset_axes((*zoom_corner(box, taken, (columns, rows)), ZOOM_SHARE * rows / columns, ZOOM_SHARE))
    zoom.imshow(
        part,
        cmap="gray",
        vmin=float(part.min()),
        vmax=max(float(np.percentile(counts, HIGHLIGHT)) for counts in (part, _within(image, box))),
        interpolation="nearest",
        extent=(left - 0.5, left + side - 0.5, top + side - 0.5, top - 0.5),
    )
    zoom.set_xticks([])
    zoom.set_yticks([])
    for spine in zoom.spines.values():
        spine.set_edgecolor(TRUTH_COLOR)
        spine.set_linewidth(0.6)

"""Figures drawn by matplotlib: a sheet of frames with their truth boxes, and a sheet of labelled pictures."""

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
FULL_RANGE = (0, 255)
"""Least and greatest grey level of an 8-bit picture."""
SHEET_FRAMES = 12
"""Largest number of frames on a sheet."""
COLUMNS = 4
CELL_IN = 3.6
"""Width of a frame on the sheet, inches."""
MAX_ENLARGEMENT = 2
"""Largest factor by which frames are enlarged where fewer than COLUMNS are on the sheet."""
TITLE_CHARS_PER_IN = 14
TRUTH_COLOR = "#ffb000"  # legible on black, grey and white, also for the colour-blind
ZOOM_PX = 32
"""Least side of the part of a frame that is drawn enlarged, px."""
ZOOM_FRACTION = 0.3
"""Height of the enlarged part on the sheet, as a fraction of the frame's height."""
NAME_PT = 7
"""Font size of targets' names, points."""
CELL_MARGIN = 1.05
"""Ratio of a cell's width to the least width of the frame in it. In such a narrow frame, text of size NAME_PT covers
more of the frame by this factor."""
WHITE_PERCENTILE = 97.0
"""Percentile of counts that is drawn white in an enlarged part: that of the target's box or, where higher, of the part.
Thus a small hot spot such as an engine does not darken the body."""
MARGIN_PX = 6.0
"""Width and height added to a drawn box, px, so that its outline does not cover the target."""


def sheet_indices(count: int, most: int = SHEET_FRAMES) -> list[int]:
    """Return at most `most` indices, spread evenly from 0 to count - 1."""
    return sorted({round(float(at)) for at in np.linspace(0, count - 1, min(count, most))})


def contact_sheet(source: Source, path: str | Path, start: int = 0, stop: int | None = None) -> Path:
    """Draw frames of a source, spread evenly over start .. stop-1, as a PNG file and return its path.

    Each frame has its number and time, the boxes of its targets, and an enlarged part around the followed target with a
    grey scale of its own. Where all frames together use less than half of the grey levels, these are stretched from
    black to white, and the title gives them. InputError where the file cannot be written, or is read by the source.
    """
    from matplotlib.figure import Figure

    path = path_of(path)
    check_output(path, *source.needs)
    indices = [start + index for index in sheet_indices((len(source) if stop is None else stop) - start)]
    columns, rows = min(COLUMNS, len(indices)), -(-len(indices) // COLUMNS)
    width, height = source.size
    cell = CELL_IN * min(COLUMNS / columns, MAX_ENLARGEMENT)
    figure = Figure(figsize=(cell * columns, (cell * height / width + 0.12) * rows + 0.5), layout="constrained")
    frames = [source.frame(index, "display") for index in indices]
    black, white = greys = grey_range([frame.image for frame in frames])
    facts = f"{width} x {height} px, {source.bits} bits, {counted(len(source), 'frame')} at {source.rate_hz:g} Hz"
    boxes = "; boxes: truth, dotted where more than half is hidden; enlarged parts have their own greys"
    key = boxes if source.has_truth else "; no truth"
    stretched = "" if greys == FULL_RANGE else f"; greys {black} to {white} drawn from black to white"
    title = fill(f"{source.name}: {facts}{key}{stretched}", int(TITLE_CHARS_PER_IN * cell * columns))
    figure.suptitle(title, fontsize=9)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, frame in zip(grid.flat, frames, strict=False):
        axes.set_axis_on()  # pixels, for start boxes and regions
        axes.tick_params(labelsize=6, length=2, pad=1)
        truth = next(iter(source.truths(frame.index, frame.index + 1)), None)
        occupied = _draw_frame(axes, frame, truth, greys, CELL_MARGIN * width / (cell * POINTS_PER_IN))
        followed = truth.target(source.follow) if truth is not None and source.follow is not None else None
        if followed is not None and followed.in_view is not False:
            _draw_zoom(axes, source.frame(frame.index).image, followed.box, occupied)
    with atomic_file(path) as file:
        figure.savefig(file, format="png", dpi=110)
    return path


def grey_range(images: Sequence[Image]) -> tuple[int, int]:
    """Return the grey levels drawn black and white: FULL_RANGE, or those in use where they are less than half of it."""
    low, high = min(int(image.min()) for image in images), max(int(image.max()) for image in images)
    return (low, high) if 0 < high - low < (FULL_RANGE[1] - FULL_RANGE[0]) / 2 else FULL_RANGE


@dataclass(frozen=True, eq=False)
class LabelledImage:
    """Picture (rows, cols) uint8 with its label, and a part of it to enlarge."""

    label: str
    image: Image
    part: Box | None = None


def labelled_sheet(pictures: Sequence[LabelledImage], path: str | Path, columns: int = COLUMNS) -> Path:
    """Draw pictures side by side, each below its label, as a PNG file and return the file's path."""
    from matplotlib.figure import Figure

    path = path_of(path)
    rows = -(-len(pictures) // columns)
    height, width = pictures[0].image.shape
    figure = Figure(figsize=(CELL_IN * columns, (CELL_IN * height / width + 0.12) * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, picture in zip(grid.flat, pictures, strict=False):
        axes.imshow(picture.image, cmap="gray", vmin=FULL_RANGE[0], vmax=FULL_RANGE[1], interpolation="nearest")
        axes.set_title(picture.label, fontsize=9, pad=2)
        if picture.part is not None:
            _draw_box(axes, picture.part, hidden=False)
            _draw_zoom(axes, picture.image, picture.part, [])
    with atomic_file(path) as file:
        figure.savefig(file, format="png", dpi=110)
    return path


def _draw_frame(axes: Axes, frame: Frame, truth: Truth | None, greys: tuple[int, int], px_per_pt: float) -> list[Box]:
    """Draw a frame with the boxes and names of its targets; return the boxes that both occupy."""
    from matplotlib.patheffects import withStroke

    rows, columns = frame.image.shape
    axes.imshow(frame.image, cmap="gray", vmin=greys[0], vmax=greys[1], interpolation="nearest")
    axes.set_title(f"frame {frame.index}, {frame.time:.2f} s", fontsize=8, pad=2)
    axes.autoscale(False)
    occupied: list[Box] = []
    names: list[Box] = []
    targets = truth.targets if truth is not None else ()
    boxes = [Box(each.cx, each.cy, each.w + MARGIN_PX, each.h + MARGIN_PX) for each in (each.box for each in targets)]
    for number, (target, box) in enumerate(zip(targets, boxes, strict=True)):
        _draw_box(axes, box, target.hidden)
        name = shortened(target.id, columns / px_per_pt)
        wide, high = (px_per_pt * points for points in _text_size(name))
        others = [*names, *boxes[:number], *boxes[number + 1 :]]
        left, bottom = name_position(box, (wide, high), (columns, rows), others)
        names.append(Box.from_edges(left, bottom - high, left + wide, bottom))
        occupied += [target.box, names[-1]]
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
    return occupied


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


def name_position(
    box: Box, extent: tuple[float, float], size: tuple[int, int], names: Sequence[Box] = ()
) -> tuple[float, float]:
    """Return the lower left corner, px, of a name with size `extent` (width, height) in a picture of `size`.

    The name is above its box, or below or inside it where there is no room above. It moves below or beside the box, or
    to one of its corners, where it overlaps less of other `names` (and boxes) there. It is inside the picture as long
    as any of the box is.
    """
    (wide, high), (columns, rows) = extent, size
    left = min(max(box.left, 0.0), box.right)
    if box.left < columns:
        left = min(left, max(columns - wide, 0.0))
    above, below, middle = box.top - 1, box.bottom + 1 + high, box.cy + high / 2
    if box.bottom < 0 or above - high >= 0:
        first = left, above
    else:
        first = left, below if below <= rows else max(box.top, 0.0) + 1 + high
    right, before = box.right + 1, box.left - 1 - wide
    others = (
        *((left, below), (right, middle), (before, middle)),
        *((box.right - wide, above), (box.right - wide, below)),
        *((x, y) for y in (above, below) for x in (right, before)),
    )
    inside = [(x, y) for x, y in others if x >= 0 and x + wide <= columns and high <= y <= rows]
    return min([first, *inside], key=lambda place: round(_overlap(place, extent, names), 6))


def _overlap(place: tuple[float, float], extent: tuple[float, float], names: Sequence[Box]) -> float:
    """Return the area, px^2, of other names that a name covers if its lower left corner is at `place`."""
    (left, bottom), (wide, high) = place, extent
    across = (max(min(left + wide, name.right) - max(left, name.left), 0.0) for name in names)
    down = (max(min(bottom, name.bottom) - max(bottom - high, name.top), 0.0) for name in names)
    return sum(x * y for x, y in zip(across, down, strict=True))


def shortened(name: str, width_pt: float) -> str:
    """Return a name, without its middle where the name would be wider than `width_pt` points."""
    kept = len(name)
    short = name
    while _text_size(short)[0] > width_pt and kept > 2:
        kept -= 1
        short = f"{name[: (kept + 1) // 2]}…{name[len(name) - kept // 2 :]}"
    return short


def _text_size(name: str) -> tuple[float, float]:
    """Return the width of a name and the height of its line, points."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0, 0), name, size=NAME_PT).get_extents().x1), 1.2 * NAME_PT


def zoom_corner(box: Box, occupied: Sequence[Box], size: tuple[int, int]) -> tuple[float, float]:
    """Return the lower left corner, in fractions of the axes, of the enlarged part in a picture of `size`, px.

    It is in the picture's corner that hides the fewest `occupied` boxes and `box` itself, or in the farthest from `box`
    of several such corners.
    """
    columns, rows = size
    width, height = ZOOM_FRACTION * rows, ZOOM_FRACTION * rows
    best: tuple[int, float] | None = None
    chosen = (0.0, 0.0)
    for left in (0.0, columns - width):
        for top in (0.0, rows - height):
            hidden = sum(
                left < other.right + MARGIN_PX
                and other.left - MARGIN_PX < left + width
                and top < other.bottom + MARGIN_PX
                and other.top - MARGIN_PX < top + height
                for other in [box, *occupied]
            )
            near = -math.hypot(left + width / 2 - box.cx, top + height / 2 - box.cy)
            if best is None or (hidden, near) < best:
                best, chosen = (hidden, near), (left / columns, 1 - (top + height) / rows)
    return chosen


def zoom_side(box: Box, size: tuple[int, int]) -> int | None:
    """Return the side, px, of the part around a box to enlarge; None where it could not be enlarged."""
    columns, rows = size
    side = max(ZOOM_PX, 2 * round(max(box.w, box.h)))
    return side if side < min(ZOOM_FRACTION * rows, columns) else None


def _pixels_in(image: Image, box: Box) -> Image:
    """Return the pixels of a picture inside a box, at least one pixel."""
    (left, top, right, bottom), (rows, columns) = box.edges, image.shape
    x, y = (min(max(round(at), 0), most - 1) for at, most in ((left, columns), (top, rows)))
    return image[y : max(round(bottom) + 1, y + 1), x : max(round(right) + 1, x + 1)]


def _draw_zoom(axes: Axes, image: Image, box: Box, occupied: Sequence[Box]) -> None:
    """Draw the part around a box enlarged in a corner of the picture, unless it could not be enlarged there.

    It has a grey scale of its own, so that it shows details of a body that is all white in the picture.
    """
    rows, columns = image.shape
    side = zoom_side(box, (columns, rows))
    if side is None:
        return
    left = min(max(round(box.cx - side / 2), 0), columns - side)
    top = min(max(round(box.cy - side / 2), 0), rows - side)
    part = image[top : top + side, left : left + side]
    zoom = axes.inset_axes(
        (*zoom_corner(box, occupied, (columns, rows)), ZOOM_FRACTION * rows / columns, ZOOM_FRACTION)
    )
    zoom.imshow(
        part,
        cmap="gray",
        vmin=float(part.min()),
        vmax=max(float(np.percentile(counts, WHITE_PERCENTILE)) for counts in (part, _pixels_in(image, box))),
        interpolation="nearest",
        extent=(left - 0.5, left + side - 0.5, top + side - 0.5, top - 0.5),
    )
    zoom.set_xticks([])
    zoom.set_yticks([])
    for spine in zoom.spines.values():
        spine.set_edgecolor(TRUTH_COLOR)
        spine.set_linewidth(0.6)

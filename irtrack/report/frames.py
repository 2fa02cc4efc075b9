"""Pictures of frames with the true box and the trackers' boxes, as inline SVG: filmstrips and first losses."""

from __future__ import annotations

import base64
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from irsim import IrsimError
from irsim.types import SHOWN, Box, Image, Source
from irtrack.bench import Results, RunRecord, SourceRow
from irtrack.metrics import Trace
from irtrack.report.line_styles import LineStyle
from irtrack.report.repeat import reopen, run_command

FRAMES = 6
"""Number of frames of a filmstrip: one row on a wide page."""

CROP_SIZES, CROP_LEAST = 5.0, 40
"""Side of the crop in units of the target's larger side, and least side of the crop, px."""

CROP_MARGIN = 1.2
"""Least side of the crop, in sides of the square around all its boxes."""

THUMB_WIDTH = 320
"""Largest width of the picture of the whole frame, px."""


@dataclass(frozen=True, eq=False)
class Follower:
    """Track of one tracker in the pictures; `lost_at`: index of the frame of its loss, or None."""

    label: str
    style: LineStyle
    trace: Trace
    lost_at: int | None

    def row(self, index: int) -> int | None:
        """Return the position of the frame `index` in the trace; None where the trace lacks it."""
        found = np.flatnonzero(self.trace.indices == index)
        return int(found[0]) if found.size else None

    def box(self, index: int) -> Box | None:
        row = self.row(index)
        return None if row is None else _box(self.trace.centers[row], self.trace.sizes[row])

    def truth(self, index: int) -> Box | None:
        row = self.row(index)
        return None if row is None else _box(self.trace.truth_centers[row], self.trace.truth_sizes[row])


def _box(center: np.ndarray, size: np.ndarray) -> Box | None:
    return Box(*map(float, center), *map(float, size)) if np.isfinite([*center, *size]).all() else None


@dataclass(frozen=True)
class Note:
    """Caption of one tracker below a picture: its status, and its centre error, px."""

    label: str
    status: str
    distance: float | None


@dataclass(frozen=True)
class Still:
    """One frame: the reason why it is shown, and two pictures as SVG elements."""

    index: int
    why: str
    crop: str
    whole: str
    notes: tuple[Note, ...]


def moments(followers: Iterable[Follower], count: int = FRAMES) -> dict[int, str]:
    """Return the frames to show, in order, with reasons: start, first occlusion, first loss, end."""
    followers = tuple(followers)
    trace = max((follower.trace for follower in followers), key=lambda trace: len(trace.indices))
    indices = trace.indices
    chosen = {int(indices[0]): "start", int(indices[-1]): "end"}
    hidden = np.flatnonzero(trace.visible < SHOWN)
    if hidden.size:
        first = int(hidden[0])
        seen_again = np.flatnonzero(~(trace.visible[first:] < SHOWN))
        back = first + int(seen_again[0]) if seen_again.size else len(indices)
        wanted = [(first - 1, "before it hides"), ((first + back - 1) // 2, "hidden"), (back, "seen again")]
        for row, why in wanted:
            if 0 <= row < len(indices):
                chosen.setdefault(int(indices[row]), why)
    losses = sorted((follower.lost_at, follower.label) for follower in followers if follower.lost_at is not None)
    if losses:
        at, label = losses[0]
        chosen[at] = f"{label} is lost"
    # Then the frames farthest in time from all chosen frames are added.
    while len(chosen) < min(count, len(indices)):
        distance = np.min(np.abs(indices[:, None] - np.array(list(chosen))), axis=1)
        chosen[int(indices[int(np.argmax(distance))])] = ""
    return dict(sorted(chosen.items()))


def still(image: Image, index: int, why: str, followers: Iterable[Follower], both: bool = False) -> Still:
    """Draw the pictures of one frame; `image`: the display picture, (rows, cols) uint8.

    both   True: the crop contains the trackers' boxes, too, not only the target's
    """
    followers = tuple(followers)
    truth = next((box for follower in followers if (box := follower.truth(index))), None)
    boxes = [(follower, box) for follower in followers if (box := follower.box(index))]
    center = truth or (boxes[0][1] if boxes else Box((image.shape[1] - 1) / 2, (image.shape[0] - 1) / 2, 1, 1))
    around = [center, *(box for _, box in boxes)] if both else [center]
    rows, cols = image.shape
    parts = {follower.label: (follower.style, box) for follower, box in boxes}
    crop = crop_picture(image, truth, parts, around)
    # In the small picture of the whole frame, boxes are drawn with a least size.
    least = max(rows, cols) / 25
    marks = {label: (style, box.at_least(least)) for label, (style, box) in parts.items()}
    whole = _svg(_jpeg(image), (0, 0, cols, rows), truth.at_least(least) if truth else None, marks, "whole")
    notes = tuple(_note(follower, index) for follower in followers)
    return Still(index, why, crop, whole, notes)


def crop_picture(
    image: Image, truth: Box | None, boxes: Mapping[str, tuple[LineStyle, Box]], around: Sequence[Box]
) -> str:
    """Return the part of a picture around boxes, the target's first, as SVG with the true and the trackers' boxes."""
    left, top, side = _crop_place(image, around)
    enlarged = image[top : top + side, left : left + side]
    return _svg(_png(_stretched(enlarged)), (left, top, *enlarged.shape[::-1]), truth, boxes, "crop")


def _note(follower: Follower, index: int) -> Note:
    row = follower.row(index)
    if row is None:
        return Note(follower.label, "not started", None)
    distance = float(np.hypot(*(follower.trace.centers[row] - follower.trace.truth_centers[row])))
    return Note(follower.label, str(follower.trace.statuses[row]), distance if np.isfinite(distance) else None)


def _crop_place(image: Image, boxes: Sequence[Box]) -> tuple[int, int, int]:
    """Return (left, top, side) of a square around boxes, moved into the frame, px."""
    rows, cols = image.shape
    left, right = min(box.left for box in boxes), max(box.right for box in boxes)
    top, bottom = min(box.top for box in boxes), max(box.bottom for box in boxes)
    target = boxes[0]
    wanted = max(CROP_SIZES * max(target.w, target.h), CROP_MARGIN * max(right - left, bottom - top), CROP_LEAST)
    side = int(min(wanted, rows, cols))
    corner_x = int(np.clip(round((left + right - side) / 2), 0, cols - side))
    corner_y = int(np.clip(round((top + bottom - side) / 2), 0, rows - side))
    return corner_x, corner_y, side


def _stretched(image: Image) -> Image:
    """Stretch the grey levels over the whole range, for faint targets."""
    low, high = np.percentile(image, (0.5, 99.8))
    return np.asarray(np.clip((image - low) * (255 / max(high - low, 1.0)), 0, 255).astype(np.uint8))


def _png(image: Image) -> str:
    return _data_uri(image, ".png", "image/png", [])


def _jpeg(image: Image) -> str:
    scale = min(1.0, THUMB_WIDTH / image.shape[1])
    small: Image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    return _data_uri(small, ".jpg", "image/jpeg", [cv2.IMWRITE_JPEG_QUALITY, 80])


def _data_uri(image: Image, suffix: str, mime: str, options: list[int]) -> str:
    encoded = cv2.imencode(suffix, np.ascontiguousarray(image), options)[1]
    return f"data:{mime};base64,{base64.b64encode(encoded.tobytes()).decode()}"


def _svg(
    uri: str,
    place: tuple[int, int, int, int],
    truth: Box | None,
    boxes: Mapping[str, tuple[LineStyle, Box]],
    name: str,
) -> str:
    """Return a picture with boxes; user units are px of the frame, pixel centres at whole numbers."""
    left, top, width, height = place
    edge = f'x="{left - 0.5}" y="{top - 0.5}" width="{width}" height="{height}"'
    parts = [
        f'<svg class="{name}" viewBox="{left - 0.5} {top - 0.5} {width} {height}">',
        f'<image {edge} preserveAspectRatio="none" href="{uri}"/>',
    ]
    for style, box in boxes.values():
        parts.append(f'<rect {_corners(box)} stroke="{style.color}" stroke-dasharray="{style.svg_dash}"/>')
    if truth:
        parts.append(f'<rect {_corners(truth)} class="truth-edge"/><rect {_corners(truth)} class="truth"/>')
    return "".join([*parts, "</svg>"])


def _corners(box: Box) -> str:
    return f'x="{box.left:.2f}" y="{box.top:.2f}" width="{box.w:.2f}" height="{box.h:.2f}"'


MOST = 48
"""Largest number of losses shown, taken from each tracker in turn."""

AFTER = 3
"""Number of frames from the loss to its picture, so that track and target are apart."""


@dataclass(frozen=True)
class Loss:
    """Run with a loss, the command that repeats it, and a picture."""

    label: str
    source: str
    seed: int
    lost_at: int
    command: str
    still: Still


def gallery(
    results: Results, cells: Sequence[RunRecord], styles: Mapping[str, LineStyle]
) -> tuple[tuple[Loss, ...], int]:
    """Return the first losses with pictures, and the number of all losses; sources that cannot be reopened are left
    out."""
    first = _first_losses(cells)
    rows = results.sources()
    sources: dict[tuple[str, str], Source | None] = {}
    found = []
    for cell in _in_turn(first)[:MOST]:
        place = cell.source, cell.key.source_hash
        if place not in sources:
            sources[place] = _reopened(rows[place])
        source = sources[place]
        if source is not None and (loss := _loss(results, cell, rows[place], source, styles)) is not None:
            found.append(loss)
    return tuple(sorted(found, key=lambda loss: (loss.source, loss.label))), len(first)


def _first_losses(cells: Sequence[RunRecord]) -> list[RunRecord]:
    """Return for each tracker and scenario (all severities) the lost run of the least severity and seed."""
    firsts: dict[tuple[str, str], RunRecord] = {}
    for cell in sorted(cells, key=lambda cell: (cell.family, cell.label, cell.severity or 0, cell.key.tracker_seed)):
        if cell.score is not None and cell.score.lost:
            firsts.setdefault((cell.family, cell.label), cell)
    return list(firsts.values())


def _in_turn(cells: Sequence[RunRecord]) -> list[RunRecord]:
    """Return every tracker's first loss, then every tracker's second, and so on."""
    nth: defaultdict[str, int] = defaultdict(int)
    order = []
    for cell in cells:
        order.append((nth[cell.label], cell.label))
        nth[cell.label] += 1
    return [cells[place] for place in sorted(range(len(cells)), key=order.__getitem__)]


def _reopened(row: SourceRow) -> Source | None:
    try:
        source = reopen(row)
    except IrsimError:
        return None
    return source if source.hash == row.hash else None


def _loss(
    results: Results, cell: RunRecord, row: SourceRow, source: Source, styles: Mapping[str, LineStyle]
) -> Loss | None:
    trace = results.trace(cell.key)
    if trace is None or cell.score is None or cell.score.lost_at is None:
        return None
    at = int(np.searchsorted(trace.indices, cell.score.lost_at))
    index = int(trace.indices[min(at + AFTER, len(trace.indices) - 1)])
    follower = Follower(cell.label, styles[cell.label], trace, cell.score.lost_at)
    try:
        picture = still(source.frame(index, "display").image, index, "", [follower], both=True)
    except IrsimError:
        return None
    return Loss(cell.label, cell.source, cell.key.tracker_seed, cell.score.lost_at, run_command(cell, row), picture)

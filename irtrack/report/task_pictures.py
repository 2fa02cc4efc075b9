"""Pictures of tracks of many targets: frames of identity switches, and replays with all tracks."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from irsim.types import Box, Image, Source, Truth
from irtrack.metrics.multiple import NOBODY
from irtrack.report.line_styles import DASHES, HUES, LineStyle
from irtrack.report.replays import fitted, jpeg
from irtrack.tracks import STATUSES

OTHER = LineStyle("#bbbbbb", (2, 2))
"""Style of tracks that never have a target."""
CROP_PX = 64
"""Side of the crop around a switch, px."""
LEAST_PX = 7.0
"""Least side of a drawn box, px of the frame."""


@dataclass(frozen=True, eq=False)
class ManyTracks:
    """Tracks of one run of many targets, from its arrays in a results file.

    frames (k,) indices;  matches (k, n) the track that each target has, or `NOBODY`;  present (k, n)
    frame, id, status, confirmed (r,), box (r, 4) cx, cy, w, h px, of each track in each frame
    names   of the targets
    """

    frames: np.ndarray
    matches: np.ndarray
    present: np.ndarray
    names: tuple[str, ...]
    frame: np.ndarray
    id: np.ndarray
    box: np.ndarray
    status: np.ndarray
    confirmed: np.ndarray

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray]) -> ManyTracks:
        """Return the tracks of the arrays of a run."""
        box = np.column_stack([arrays[name] for name in ("cx", "cy", "w", "h")])
        plain = {name: arrays[name] for name in ("frames", "matches", "present", "frame", "id", "status", "confirmed")}
        return cls(**plain, names=tuple(arrays["names"].tolist()), box=box)

    def styles(self) -> dict[int, LineStyle]:
        """Return a style for each track that ever has a target, in the order of their first frames."""
        order = list(dict.fromkeys(self.matches[self.matches != NOBODY].tolist()))
        return {
            track: LineStyle(HUES[place % len(HUES)], DASHES[place // len(HUES) % len(DASHES)])
            for place, track in enumerate(order)
        }

    def switches(self) -> list[tuple[int, int, int, int]]:
        """Return (row of the frame, target, track before, track after) of each change of identity, in order."""
        found = []
        for target, column in enumerate(self.matches.T):
            rows = np.flatnonzero(column != NOBODY)
            for before, after in zip(rows[:-1].tolist(), rows[1:].tolist(), strict=True):
                if column[before] != column[after]:
                    found.append((after, target, int(column[before]), int(column[after])))
        return sorted(found)

    def at(self, index: int) -> list[tuple[int, Box, str]]:
        """Return (id, box, status) of the confirmed tracks in a frame."""
        rows = np.flatnonzero((self.frame == index) & self.confirmed)
        return [(int(self.id[k]), Box(*self.box[k].tolist()), STATUSES[int(self.status[k])]) for k in rows]


@dataclass(frozen=True)
class SwitchFrame:
    """Frame of identity switches: its index, a description, its element id, and two pictures as SVG elements."""

    index: int
    title: str
    anchor: str
    crop: str
    whole: str


def switch_frames(source: Source, tracks: ManyTracks, prefix: str, most: int) -> tuple[SwitchFrame, ...]:
    """Return pictures of the first `most` frames with a switch, all tracks drawn in the colours of their identities.

    Errors of irsim where the source cannot be read are passed on.
    """
    by_frame: dict[int, list[tuple[int, int, int, int]]] = {}
    for switch in tracks.switches():
        by_frame.setdefault(int(tracks.frames[switch[0]]), []).append(switch)
    styles = tracks.styles()
    found = []
    for index in list(by_frame)[:most]:
        own = by_frame[index]
        title = ", ".join(f"{tracks.names[target]}: track {before} to {after}" for _, target, before, after in own)
        image = source.frame(index, "display").image
        boxes = tracks.at(index)
        middle = next((box for id, box, _ in boxes if id == own[0][3]), Box(0, 0, 1, 1))
        crop, whole = (_picture(image, boxes, styles, place) for place in (_around(image, middle), None))
        found.append(SwitchFrame(index, title, f"{prefix}-{index}", crop, whole))
    return tuple(found)


def _around(image: Image, box: Box) -> tuple[int, int, int]:
    rows, cols = image.shape
    side = min(CROP_PX, rows, cols)
    left = int(np.clip(round(box.cx - side / 2), 0, cols - side))
    return left, int(np.clip(round(box.cy - side / 2), 0, rows - side)), side


def _picture(
    image: Image,
    boxes: Sequence[tuple[int, Box, str]],
    styles: Mapping[int, LineStyle],
    crop: tuple[int, int, int] | None,
) -> str:
    """Return a frame, or its square (left, top, side), with all boxes and their numbers, as an SVG element."""
    rows, cols = image.shape
    left, top, width, height = (0, 0, cols, rows) if crop is None else (crop[0], crop[1], crop[2], crop[2])
    part = image[top : top + height, left : left + width]
    low, high = np.percentile(image, (0.5, 99.8))
    shades = np.clip((part - low) * (255 / max(high - low, 1.0)), 0, 255).astype(np.uint8)
    suffix, mime = (".jpg", "jpeg") if crop is None else (".png", "png")
    options = [cv2.IMWRITE_JPEG_QUALITY, 75] if crop is None else []
    data = base64.b64encode(cv2.imencode(suffix, np.ascontiguousarray(shades), options)[1].tobytes()).decode()
    edge = f'x="{left - 0.5}" y="{top - 0.5}" width="{width}" height="{height}"'
    size = width / 18
    parts = [
        f'<svg class="{"whole" if crop is None else "crop"}" viewBox="{left - 0.5} {top - 0.5} {width} {height}">',
        f'<image {edge} preserveAspectRatio="none" href="data:image/{mime};base64,{data}"/>',
    ]
    for id, box, _ in boxes:
        style, drawn = styles.get(id, OTHER), box.at_least(LEAST_PX)
        parts.append(
            f'<rect x="{drawn.left:.1f}" y="{drawn.top:.1f}" width="{drawn.w:.1f}" height="{drawn.h:.1f}" '
            f'stroke="{style.color}" stroke-dasharray="{style.svg_dash}"/>'
            f'<text x="{drawn.right + 1:.1f}" y="{drawn.top + size / 2:.1f}" font-size="{size:.1f}" '
            f'fill="#fff">{id}</text>'
        )
    return "".join([*parts, "</svg>"])


@dataclass(frozen=True)
class ManyReplay:
    """Replay of all tracks of a run: data as `irtrack.report.replays.Replay`."""

    data: str
    stride: int


def many_replay(source: Source, tracks: ManyTracks, most_bytes: int) -> ManyReplay:
    """Return the replay of a run with all of its tracks and targets. Errors of irsim are passed on."""
    scale, stride = fitted(source, tracks.frames, most_bytes)
    kept = tracks.frames[::stride]
    wanted = set(kept.tolist())
    pictures, times, truths = [], [], []
    for frame, truth in source.pairs(int(tracks.frames[0]), int(tracks.frames[-1]) + 1, input="display"):
        if frame.index in wanted:
            pictures.append(base64.b64encode(jpeg(frame.image, scale)).decode())
            times.append(round(frame.time, 4))
            truths.append(_boxes(truth))
    styles = tracks.styles()
    numbers = {id: place for place, id in enumerate(styles)}
    others = [id for id in np.unique(tracks.id[tracks.confirmed]).tolist() if id not in numbers]
    numbers |= {id: len(numbers) + place for place, id in enumerate(others)}
    data: dict[str, Any] = {
        "size": list(source.size),
        "rate": source.rate_hz,
        "indices": kept.tolist(),
        "times": times,
        "pictures": pictures,
        "truth": {"boxes": truths},
        "identities": [
            {"id": id, "color": style.color, "dash": list(style.dash)}
            for id, style in [*styles.items(), *((id, OTHER) for id in others)]
        ],
        "tracks": [
            [[numbers[id], *_numbers(box), status == "tracking"] for id, box, status in tracks.at(index)]
            for index in kept.tolist()
        ],
        "lanes": [
            [
                (numbers[track] if track != NOBODY else -1) if seen else None
                for track, seen in zip(
                    tracks.matches[::stride, n].tolist(), tracks.present[::stride, n].tolist(), strict=True
                )
            ]
            for n in range(len(tracks.names))
        ],
        "switches": sorted({int(tracks.frames[row]) for row, *_ in tracks.switches()}),
    }
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return ManyReplay(text, stride)


def _boxes(truth: Truth | None) -> list[list[float]]:
    targets = () if truth is None else truth.targets
    return [_numbers(each.box) for each in targets if each.in_view is not False and not each.hidden]


def _numbers(box: Box) -> list[float]:
    return [round(value, 1) for value in (box.cx, box.cy, box.w, box.h)]

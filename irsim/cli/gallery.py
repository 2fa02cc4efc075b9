"""Pictures of every target kind, as a camera shows them, with labels or as riddles: `irsim gallery`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import AWAY, euler
from irsim.physics.radiometry import radiance, temperature
from irsim.recording.output import atomic_text, check_output, write_png
from irsim.render.composite import draw_over
from irsim.rng import normals, stream
from irsim.targets import SHAPES, Shape, View
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.types import Band, Image

CROP = 64
"""Side of a crop, px."""
FILL = 0.84
"""Share of the crop that the body fills, on its longer side."""
ENLARGED = 2
ABREAST = 3
"""Kinds in a row of the sheet."""
LABEL = 22
"""Height of a label, px."""
BLIND_EACH = 2
"""Crops of each kind in a blind test."""
BLIND_LARGER = 6
"""How many times a crop is enlarged in a blind test, in its larger copy."""
NOISE_K = 0.08
"""Of the camera, K."""
SPAN_K = 12.0
"""Least span of temperatures from black to white, K."""


def typical(kind: str) -> Shape:
    """The shape of a kind as it is when nothing but what must be is given."""
    shape = SHAPES.find(kind).model_validate({})
    assert isinstance(shape, Shape)
    return shape


def crop(shape: Shape, pose: Angles, *, band: Band = "lwir", time: float = 0.0, side: int = CROP) -> Image:
    """(side, side) uint8: the body filling most of the picture before an even background, a little noise on it.

    pose  yaw, pitch, roll, degrees, as for targets; white is the 99th percentile of the temperatures
          in the crop, black the first, at least SPAN_K apart
    """
    behind = float(radiance(band, shape.picture_background_k))
    context = SceneContext(0, Geometry((side, side), 5e-4), 30.0, band, 0.6, ambient=behind)
    sprite = framed(shape, pose, context, time)
    light = np.full((side, side), behind)
    draw_over(light, sprite)
    shown = temperature(band, light) + NOISE_K * normals((side, side), 0, "gallery", shape.kind, 0)
    low, high = np.percentile(shown, [1.0, 99.0])
    low, high = min(low, shape.picture_background_k - SPAN_K / 4), max(high, low + SPAN_K)
    return np.asarray(np.clip((shown - low) / (high - low), 0, 1) * 255).round().astype(np.uint8)


@dataclass(frozen=True)
class Riddle:
    """One crop of a blind test: its kind and how that is posed: yaw, pitch, roll, degrees, and the time, s."""

    kind: str
    pose: Angles
    time: float


def riddles(seed: int) -> list[Riddle]:
    """BLIND_EACH of every kind in random order, at any yaw; pitch and roll lie within those of the kind's poses."""
    draw = stream(seed, "gallery", "blind")
    found = []
    for kind in bodies():
        poses = np.array(typical(kind).picture_poses)
        for _ in range(BLIND_EACH):
            _, pitch, roll = draw.uniform(poses.min(axis=0), poses.max(axis=0)).tolist()
            found.append(Riddle(kind, (float(draw.uniform(0, 360)), pitch, roll), float(draw.uniform(0, 1))))
    return [found[place] for place in draw.permutation(len(found))]


def write_blind(folder: Path, seed: int) -> Path:
    """Write a blind test: numbered crops without labels, as they are and enlarged, into a new folder.

    Returns what they are: a CSV file beside the folder. InputError where either cannot be written.
    """
    key = folder.with_name(f"{folder.name}-key.csv")
    check_output(key)
    try:
        folder.mkdir()
    except OSError as error:
        raise InputError(f"{folder}: {error.strerror}; allowed: the name of a new folder") from None
    lines = ["picture,kind,yaw_deg,pitch_deg,roll_deg,time_s"]
    for number, riddle in enumerate(riddles(seed), start=1):
        picture = crop(typical(riddle.kind), riddle.pose, time=riddle.time)
        larger = cv2.resize(picture, None, fx=BLIND_LARGER, fy=BLIND_LARGER, interpolation=cv2.INTER_CUBIC)
        write_png(folder / f"{number:02}.png", picture)
        write_png(folder / f"{number:02}-large.png", np.asarray(larger, np.uint8))
        yaw, pitch, roll = riddle.pose
        lines.append(f"{number:02},{riddle.kind},{yaw:.0f},{pitch:.0f},{roll:.0f},{riddle.time:.3f}")
    with atomic_text(key) as file:
        file.write("\n".join(lines) + "\n")
    return key


def framed(shape: Shape, pose: Angles, context: SceneContext, time: float) -> Sprite:
    """The body in the middle of the frame, at the range where it fills it; pose as in `crop`, time in s."""
    side = context.geometry.size[0]
    down = np.radians(shape.picture_depression_deg)
    tilt = np.array([[1, 0, 0], [0, np.cos(down), -np.sin(down)], [0, np.sin(down), np.cos(down)]])
    attitude = tilt @ AWAY @ euler(np.array(pose))
    place, range_m = np.array([(side - 1) / 2] * 2), 3000.0

    def drawn() -> Sprite:
        sprite = shape.draw(View(context.geometry.place(place, range_m), attitude, context, time))
        assert sprite is not None
        return sprite

    for _ in range(4):
        box = drawn().box
        place = place + (side - 1) / 2 - np.array([box.cx, box.cy])
        range_m *= max(box.w, box.h) / (FILL * side)
    return drawn()


def bodies() -> Iterator[str]:
    """The kinds that have a form and need no file."""
    for name, kind in SHAPES:
        if issubclass(kind, Body) and not any(field.is_required() for field in kind.model_fields.values()):
            yield name


def sheet() -> Image:
    """(rows, columns) uint8: every kind with its name, in each of its poses."""
    blocks = []
    for name in bodies():
        shape = typical(name)
        crops = np.concatenate([crop(shape, pose) for pose in shape.picture_poses], axis=1)
        large = cv2.resize(crops, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_NEAREST)
        label = np.full((LABEL, large.shape[1]), 255, dtype=np.uint8)
        cv2.putText(label, name, (6, LABEL - 7), cv2.FONT_HERSHEY_SIMPLEX, 0.5, 0, 1, cv2.LINE_AA)
        blocks.append(np.pad(np.concatenate([label, large]), 3, constant_values=255))
    blocks += [np.full_like(blocks[0], 255)] * (-len(blocks) % ABREAST)
    rows = [np.concatenate(blocks[at : at + ABREAST], axis=1) for at in range(0, len(blocks), ABREAST)]
    return np.concatenate(rows)


def write_sheet(path: Path) -> Path:
    """Write the sheet as a PNG file and return its path. InputError where the file cannot be written."""
    write_png(path, sheet())
    return path

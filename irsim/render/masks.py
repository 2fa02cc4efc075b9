"""Coverage masks of targets: of the whole target, and of its visible part."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError
from irsim.recording.output import make_folder, refuse_leftovers, refuse_others, write_png
from irsim.render.composite import DrawnTarget
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario, expect_scenario
from irsim.types import Bools, frame_range

KINDS = ("whole", "visible")
"""Masks of a target in a frame, by the words in their file names."""

HALF = 0.5
"""Share of its greatest coverage from which a pixel belongs to a target."""

Shares = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mask:
    """Coverage of a frame's pixels, (rows, columns), by one target before the blur of the optics (for a point: after
    it).

    With motion blur, coverage is the mean over the exposure.

    whole    fraction 0..1 of each pixel that the target covers, occluded or not
    visible  `whole` less the occluded part
    area     area of the whole target, px2, including any part outside the frame

    The visible fraction in the ground truth is the sum of `visible` over `area`.
    """

    whole: Shares
    visible: Shares
    area: float


def masks(scenario: Scenario, start: int = 0, stop: int | None = None) -> Iterator[dict[str, Mask]]:
    """Yield the masks of all existing targets, by id, for each arriving frame start .. stop-1, as in `irsim.frames`."""
    return _masks(expect_scenario("masks", scenario), start, stop)


def _masks(scenario: Scenario, start: int, stop: int | None) -> Iterator[dict[str, Mask]]:
    renderer, arrivals = Renderer(scenario), scenario.arrivals
    columns, rows = scenario.camera.size
    for index in frame_range(start, stop, len(arrivals)):
        yield {drawn.piece.name: _mask(drawn, (rows, columns)) for drawn in renderer.drawn_targets(arrivals[index])}


def visible_pixels(drawn: Iterable[DrawnTarget], shape: tuple[int, int]) -> dict[str, Bools]:
    """Return the pixels of a frame, (rows, columns), that belong to each target, by id.

    A pixel belongs to a target where its visible coverage is at least half of the target's greatest coverage: half
    covered by a body, and within the half maximum of the spot of a point.
    """
    found = {}
    for target in drawn:
        sprite, pixels = target.piece.sprite, np.zeros(shape, bool)
        met = sprite.within(shape)
        if met is not None and (greatest := sprite.cover.max()) > 0:
            pixels[met[1]] = target.visible_cover[met[0]] >= HALF * min(greatest, 1.0)
        found[target.piece.name] = pixels
    return found


def write_masks(
    scenario: Scenario, folder: Path, start: int, stop: int, target: str | None = None, first: int = 0
) -> Iterator[list[Path]]:
    """Write the masks of frames start .. stop-1 as `NNNNNN_ID_whole.png` and `NNNNNN_ID_visible.png`, frame by frame.

    A pixel that the target covers wholly is 255. NNNNNN is the frame's number less `first`, as in a recording that
    begins with arriving frame `first` of the scenario. Older masks of these frames and targets are replaced, or removed
    where a target is absent. InputError if there is no such target, if the folder cannot be made, and if it contains
    masks of other frames or targets, or other PNG files.
    """
    names = [each.id for each in scenario.targets if scenario.is_on(each.id)]
    if target is not None and target not in names:
        raise InputError(f"target {target!r}: there is no such target; allowed: {', '.join(names) or 'nothing'}")
    wanted, numbers = (names if target is None else [target]), range(start - first, stop - first)
    refuse_others(folder, _is_no_mask, "pictures that are no masks", "irsim masks")
    refuse_leftovers(folder, lambda file: _stays(file, numbers, wanted), "masks")
    make_folder(folder)
    for index, found in enumerate(masks(scenario, start, stop), start - first):
        paths = []
        for name in wanted:
            for kind in KINDS:
                path = folder / _file(index, name, kind)
                if name in found:
                    write_png(path, np.rint(255 * getattr(found[name], kind)).astype(np.uint8))
                    paths.append(path)
                else:
                    path.unlink(missing_ok=True)
        yield paths


def _file(number: int, name: str, kind: str) -> str:
    return f"{number:06}_{name}_{kind}.png"


_NAME = re.compile(rf"(\d{{6,}})_(.+)_({'|'.join(KINDS)})\.png")


def _is_no_mask(file: str) -> bool:
    """Return True if a file is a PNG picture whose name is not that of a mask."""
    return file.lower().endswith(".png") and _NAME.fullmatch(file) is None


def _stays(file: str, numbers: range, names: Sequence[str]) -> bool:
    """Return True if a file is a mask of a frame or target other than those given, and so would not be replaced."""
    match = _NAME.fullmatch(file)
    if match is None:
        return False
    number, name, kind = int(match[1]), match[2], match[3]
    return not (number in numbers and name in names and file == _file(number, name, kind))


def _mask(drawn: DrawnTarget, shape: tuple[int, int]) -> Mask:
    sprite = drawn.piece.sprite
    whole, visible = np.zeros((2, *shape))
    met = sprite.within(shape)
    if met is not None:
        inner, outer = met
        whole[outer], visible[outer] = (np.clip(cover[inner], 0, 1) for cover in (sprite.cover, drawn.visible_cover))
    return Mask(whole, visible, sprite.area)

"""Coverage masks of targets: of the whole target, and of its visible part."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError
from irsim.recording.output import make_folder, refuse_leftovers, refuse_others, write_png
from irsim.render.composite import DrawnTarget
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario, expect_scenario
from irsim.types import frame_range

KINDS = ("whole", "visible")
"""Masks of a target in a frame, by their names in files."""

Shares = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mask:
    """Coverage of a frame's pixels, (rows, columns), by one target before blur by the optics (of a point: after it).

    With motion blur, the mean over the exposure.

    whole    share 0..1 of each pixel's area that the unoccluded target covers
    visible  the same, less the occluded part
    area     of the whole target, px2, the part outside the frame included

    Truth's visible fraction is the sum of `visible` over `area`.
    """

    whole: Shares
    visible: Shares
    area: float


def masks(scenario: Scenario, start: int = 0, stop: int | None = None) -> Iterator[dict[str, Mask]]:
    """Yield the masks of all existing targets, by id, of frames start .. stop-1 that arrive, as in `irsim.frames`.

    InputError for an argument that is not a scenario, and for frame numbers below 0 or not whole.
    """
    return _masks(expect_scenario("masks", scenario), start, stop)


def _masks(scenario: Scenario, start: int, stop: int | None) -> Iterator[dict[str, Mask]]:
    renderer, arrivals = Renderer(scenario), scenario.arrivals
    columns, rows = scenario.camera.size
    for index in frame_range(start, stop, len(arrivals)):
        yield {drawn.piece.name: _mask(drawn, (rows, columns)) for drawn in renderer.drawn_targets(arrivals[index])}


def write_masks(
    scenario: Scenario, folder: Path, start: int, stop: int, target: str | None = None, first: int = 0
) -> Iterator[list[Path]]:
    """Write the masks of frames start .. stop-1 as `NNNNNN_ID_whole.png` and `NNNNNN_ID_visible.png`, frame by frame.

    255 is a pixel that the target covers wholly. NNNNNN is the frame's number less `first`: that of a recording whose
    frame 0 was the scenario's arriving frame `first`. Older masks of these frames and targets are replaced, or removed
    if a target is absent. InputError if there is no such target, if the folder cannot be made, and if it holds masks of
    other frames or targets, or other PNG files.
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
    """Return whether a file is a picture without the name of a mask."""
    return file.lower().endswith(".png") and _NAME.fullmatch(file) is None


def _stays(file: str, numbers: range, names: Sequence[str]) -> bool:
    """Return whether a file is a mask of another frame or target than these."""
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

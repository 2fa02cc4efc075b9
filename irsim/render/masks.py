"""Which pixels a target covers: all of it, and what is seen of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError
from irsim.recording.output import make_folder, refuse_leftovers, refuse_others, write_png
from irsim.render.composite import Seen
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario, expect_scenario
from irsim.types import Floats, frame_range

KINDS = ("whole", "visible")
"""Masks of a target in a frame, as files name them."""

Shares = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mask:
    """Of one target in one frame, before optics blur it (a point's light, after): (rows, columns) of the frame. Where
    the camera smears, means over the exposure.

    whole    share 0..1 of each pixel's area that the target covers, were nothing before it
    visible  the same, less what nearer things hide
    area     px2 of the whole target, what lies outside the frame too

    Truth's visible fraction is the sum of `visible` over `area`.
    """

    whole: Shares
    visible: Shares
    area: float


def masks(scenario: Scenario, start: int = 0, stop: int | None = None) -> Iterator[dict[str, Mask]]:
    """The masks of frames start .. stop-1 in order: of all targets that are there, by id.

    Frames are those that arrive, as of `irsim.frames`: where the camera's faults drop or double some, the k-th masks
    are of the k-th that arrives. InputError for what is no scenario, for a number below 0 and for what is no whole
    number.
    """
    return _masks(expect_scenario("masks", scenario), start, stop)


def _masks(scenario: Scenario, start: int, stop: int | None) -> Iterator[dict[str, Mask]]:
    renderer, arrivals = Renderer(scenario), scenario.arrivals
    columns, rows = scenario.camera.size
    for index in frame_range(start, stop, len(arrivals)):
        yield {seen.piece.name: _mask(seen, (rows, columns)) for seen in renderer.seen(arrivals[index])}


def write_masks(
    scenario: Scenario, folder: Path, start: int, stop: int, target: str | None = None, first: int = 0
) -> Iterator[list[Path]]:
    """Write the masks of frames start .. stop-1 as `NNNNNN_ID_whole.png` and `NNNNNN_ID_visible.png`, frame by frame.

    8 bits: 255 is a pixel that the target covers wholly. The folder is made where it is missing. NNNNNN is the frame's
    number less `first`: that of a recording whose frame 0 was the scenario's arriving frame `first`. Older masks of
    these frames and targets are replaced, or removed where a target is now absent.
    InputError where it cannot be, where there is no such target, and where the folder holds masks of other frames or
    targets: nobody could tell whether they belong to the same scene. So where it holds other PNG files, such as frames
    of a camera, which are imported by the folder.
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
    """Is a file a picture, and of a name that no mask has?"""
    return file.lower().endswith(".png") and _NAME.fullmatch(file) is None


def _stays(file: str, numbers: range, names: Sequence[str]) -> bool:
    """Is a file a mask, and of another frame or target than these?"""
    told = _NAME.fullmatch(file)
    if told is None:
        return False
    number, name, kind = int(told[1]), told[2], told[3]
    return not (number in numbers and name in names and file == _file(number, name, kind))


def _mask(seen: Seen, shape: tuple[int, int]) -> Mask:
    sprite = seen.piece.sprite
    whole, visible = np.zeros((2, *shape))
    met = sprite.within(shape)
    if met is not None:
        inner, outer = met
        whole[outer], visible[outer] = _shares(sprite.cover[inner]), _shares(seen.kept[inner])
    return Mask(whole, visible, sprite.area)


def _shares(values: Floats) -> Shares:
    return np.clip(np.asarray(values, dtype=np.float64), 0, 1)

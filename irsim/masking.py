"""Which pixels a target covers: all of it, and what is seen of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from irsim.compose import Seen, overlap
from irsim.errors import InputError
from irsim.files import make_folder, write_png
from irsim.render import Renderer
from irsim.scenario import Scenario
from irsim.span import span
from irsim.types import Floats

Shares = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mask:
    """Of one target in one frame, before optics blur it (a point's light, after): (rows, columns) of the frame.

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
    are of the k-th that arrives. InputError for a number below 0 and for what is no whole number.
    """
    renderer, arrivals = Renderer(scenario), scenario.arrivals
    columns, rows = scenario.camera.size
    for index in span(start, stop, len(arrivals)):
        yield {seen.piece.name: _mask(seen, (rows, columns)) for seen in renderer.seen(arrivals[index])}


def write_masks(
    scenario: Scenario, folder: Path, start: int, stop: int, target: str | None = None, first: int = 0
) -> Iterator[list[Path]]:
    """Write the masks of frames start .. stop-1 as `NNNNNN_ID_whole.png` and `NNNNNN_ID_visible.png`, frame by frame.

    8 bits: 255 is a pixel that the target covers wholly. The folder is made where it is missing. NNNNNN is the frame's
    number less `first`: that of a recording whose frame 0 was the scenario's arriving frame `first`.
    InputError where it cannot be, and where there is no such target.
    """
    names = [each.id for each in scenario.targets if scenario.is_on(each.id)]
    if target is not None and target not in names:
        raise InputError(f"--target {target}: there is no such target; allowed: {', '.join(names) or 'nothing'}")
    make_folder(folder)
    for index, found in enumerate(masks(scenario, start, stop), start - first):
        paths = []
        for name, mask in found.items():
            if target in (None, name):
                for what in ("whole", "visible"):
                    paths.append(folder / f"{index:06}_{name}_{what}.png")
                    write_png(paths[-1], np.rint(255 * getattr(mask, what)).astype(np.uint8))
        yield paths


def _mask(seen: Seen, shape: tuple[int, int]) -> Mask:
    sprite = seen.piece.sprite
    whole, visible = np.zeros((2, *shape))
    met = overlap((sprite.x0, sprite.y0), sprite.cover.shape, (0, 0), shape)
    if met is not None:
        inner, outer = met
        whole[outer], visible[outer] = _shares(sprite.cover[inner]), _shares(seen.left[inner])
    return Mask(whole, visible, sprite.area)


def _shares(values: Floats) -> Shares:
    return np.clip(np.asarray(values, dtype=np.float64), 0, 1)

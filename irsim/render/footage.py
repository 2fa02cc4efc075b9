"""Ground truth of the footage's own targets, behind the objects that are drawn into it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from irsim.geometry.sprite import Sprite
from irsim.render.composite import OCCLUDER_SHARE, NamedSprite
from irsim.types import Box, TargetTruth


def footage_id(name: str, taken: Collection[str]) -> str:
    """Return the id of a target of the footage: `footage-` precedes it where a new part has the same name."""
    return footage_id(f"footage-{name}", taken) if name in taken else name


def footage_truth(
    found: Iterable[TargetTruth], pieces: Sequence[NamedSprite], taken: Collection[str]
) -> list[TargetTruth]:
    """Return the labels of the footage's targets, with the fractions that the drawn objects hide.

    An object that covers at least OCCLUDER_SHARE of a target's box is one of its occluders. The footage has boxes only:
    the covered share of the box counts as hidden, and a target of unknown visibility as fully visible before.
    """
    return [_occluded(replace(target, id=footage_id(target.id, taken)), pieces) for target in found]


def _occluded(target: TargetTruth, pieces: Sequence[NamedSprite]) -> TargetTruth:
    shares = {piece.name: _covered(target.box, piece.sprite) for piece in pieces}
    hiding = {name: share for name, share in shares.items() if share >= OCCLUDER_SHARE}
    if not hiding:
        return target
    before = 1.0 if target.visible is None else target.visible
    visible = before * float(np.prod([1 - share for share in hiding.values()]))
    return replace(target, visible=visible, occluders=(*target.occluders, *hiding))


def _covered(box: Box, sprite: Sprite) -> float:
    """Return the share 0..1 of a box that a sprite covers."""
    if box.w <= 0 or box.h <= 0:
        return 0.0
    rows, columns = sprite.cover.shape
    down = _overlap(box.top - sprite.y0 + 0.5, box.bottom - sprite.y0 + 0.5, rows)
    across = _overlap(box.left - sprite.x0 + 0.5, box.right - sprite.x0 + 0.5, columns)
    return min(max(float(down @ sprite.cover @ across) / (box.w * box.h), 0.0), 1.0)


def _overlap(low: float, high: float, count: int) -> np.ndarray:
    """Return the part of each of `count` pixels, from 0 to 1, 1 to 2, ..., that lies between `low` and `high`."""
    edges = np.clip(np.arange(count + 1), low, high)
    return np.diff(edges)

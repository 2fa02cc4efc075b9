"""Realism of pictures beside real clips, by class of background: how surely they are told apart, and by which features.

Beside each AUC stand its floor (halves of the real places against each other) and its ceiling (naive pictures, blurred
noise with white noise).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from irsim.calibration.discriminator import discriminate, floor, nearest_distance
from irsim.calibration.patch_features import patch_features
from irsim.calibration.patches import BURST, SIDE_PX, Patches, PatchGroup, some
from irsim.calibration.selection import Progress
from irsim.calibration.statistics import Estimate
from irsim.errors import InputError
from irsim.rng import stream

LEAST_PLACES = 4
LEAST_SCENES = 2
_MOST_PATCHES = 2000
"""Most real patches of a class; more places give fewer patches each."""
_FAMILY_HALVINGS = 3
EXAMPLES = 8

Groups = Mapping[str, Sequence[PatchGroup]]
"""Groups of patches by class of background."""


@dataclass(frozen=True, eq=False)
class ClassRealism:
    """Separability of rendered and real pictures of one class of background, by a classifier.

    auc, floor, ceiling   rendered against real, halves of the real places against each other, naive against real
    families              AUC by one family of features alone
    distance              to the nearest real place; 1: as near as real places are to each other
    real, rendered        example patches (n, BURST, SIDE_PX, SIDE_PX)
    too_few               reason why there are no figures, or None
    """

    background: str
    places: int
    scenes: int
    auc: Estimate | None = None
    floor: Estimate | None = None
    ceiling: Estimate | None = None
    families: Mapping[str, Estimate] | None = None
    distance: float | None = None
    real: Patches | None = None
    rendered: Patches | None = None
    too_few: str | None = None

    def as_json(self) -> dict[str, Any]:
        if self.auc is None or self.floor is None or self.ceiling is None or self.families is None:
            return {"places": self.places, "scenes": self.scenes, "too_few": self.too_few}
        return {
            "places": self.places,
            "scenes": self.scenes,
            "auc": self.auc.as_json(),
            "floor": self.floor.as_json(),
            "ceiling": self.ceiling.as_json(),
            "families": {name: each.as_json() for name, each in self.families.items()},
            "distance": self.distance,
        }


def realism_against(rendered: Groups, real: Groups, progress: Progress | None = None) -> list[ClassRealism]:
    """Return the figures of each class of background that `rendered` has.

    A class with fewer than four real places or two scenes is "too few". InputError for a class that `real` has not, and
    where every class is too few.
    """
    for background in rendered:
        if background not in real:
            raise InputError(f"class {background!r}: there are no real clips of it; allowed: {', '.join(sorted(real))}")
    found = []
    for done, (background, scenes) in enumerate(rendered.items(), start=1):
        found.append(_class_realism(background, real[background], scenes))
        if progress is not None:
            progress(done, len(rendered))
    if all(each.too_few for each in found):
        raise InputError("; ".join(f"{each.background}: {each.too_few}" for each in found))
    return found


def _class_realism(background: str, real: Sequence[PatchGroup], rendered: Sequence[PatchGroup]) -> ClassRealism:
    counts = len(real), len(rendered)
    for what, count, least in (("places", counts[0], LEAST_PLACES), ("scenes", counts[1], LEAST_SCENES)):
        if count < least:
            return ClassRealism(background, *counts, too_few=f"too few {what}: {count}; allowed: at least {least}")
    most = max(_MOST_PATCHES // len(real), 8)
    places, scenes = ([some([each.patches], each.name, most) for each in groups] for groups in (real, rendered))
    naive = [naive_patches(len(each), f"{background} {k}") for k, each in enumerate(places)]
    tables = [[patch_features(each) for each in groups] for groups in (places, scenes, naive)]
    all_real, all_rendered, all_naive = ([np.hstack(list(each.values())) for each in table] for table in tables)
    return ClassRealism(
        background,
        *counts,
        auc=discriminate(all_real, all_rendered, background),
        floor=floor(all_real, background),
        ceiling=discriminate(all_real, all_naive, f"{background} naive", _FAMILY_HALVINGS),
        families={
            family: discriminate(
                [each[family] for each in tables[0]],
                [each[family] for each in tables[1]],
                f"{background} {family}",
                _FAMILY_HALVINGS,
            )
            for family in tables[0][0]
        },
        distance=nearest_distance(all_real, all_rendered),
        real=_examples(places, f"{background} real"),
        rendered=_examples(scenes, f"{background} rendered"),
    )


def _examples(groups: Sequence[Patches], name: str) -> Patches:
    """Return example patches, of as many groups as possible."""
    order = stream(0, "realism", "examples", name).permutation(len(groups))
    picked = [groups[order[k % len(groups)]] for k in range(EXAMPLES)]
    return np.stack([each[(k * len(each)) // EXAMPLES] for k, each in enumerate(picked)])


def naive_patches(count: int, name: str) -> Patches:
    """Return patches of a naive scene: Gaussian noise, blurred, with white noise in each frame."""
    generator = stream(0, "realism", "naive", name)
    sigma_px, level, contrast, noise = generator.uniform((2, 60, 8, 0.5), (8, 180, 40, 3))
    wide = SIDE_PX + 8 * int(np.ceil(sigma_px))
    found = np.empty((count, BURST, SIDE_PX, SIDE_PX), np.uint8)
    for patch in found:
        field = np.asarray(cv2.GaussianBlur(generator.standard_normal((wide, wide)), (0, 0), sigma_px))
        edge = (wide - SIDE_PX) // 2
        field = field[edge : edge + SIDE_PX, edge : edge + SIDE_PX] * (2 * np.sqrt(np.pi) * sigma_px * contrast)
        frames = level + field + noise * generator.standard_normal(patch.shape)
        np.copyto(patch, np.clip(np.rint(frames), 0, 255), casting="unsafe")
    return found


def against_lines(found: Sequence[ClassRealism]) -> Iterator[str]:
    """Yield the figures as lines of a table."""
    yield f"{'class':10} places scenes  AUC (95 %)         real halves        naive  distance  " + "by one family alone"
    for each in found:
        head = f"{each.background:10} {each.places:6} {each.scenes:6}  "
        if each.auc is None or each.floor is None or each.ceiling is None or each.families is None:
            yield f"{head}{each.too_few}"
            continue
        families = ", ".join(f"{name} {auc.value:.2f}" for name, auc in each.families.items())
        yield (
            f"{head}{interval_text(each.auc):18} {interval_text(each.floor):18} {each.ceiling.value:.2f}   "
            f"{each.distance:8.2f}  {families}"
        )


def interval_text(value: Estimate) -> str:
    return f"{value.value:.2f} ({value.low:.2f}-{value.high:.2f})"

"""The sheet of all kinds of targets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from irsim.backgrounds import BACKGROUNDS
from irsim.camera.presets import PRESETS
from irsim.cli import gallery
from irsim.cli.figures import LabelledImage
from irsim.cli.gallery import CROP_PX, FILL, body_kinds, crop, default_shape
from irsim.errors import InputError
from irsim.targets import SHAPES
from irsim.targets.body import Body


def test_target_sheet_has_all_bodies_without_files() -> None:
    assert {name for name, kind in SHAPES if issubclass(kind, Body)} == set(body_kinds())


@pytest.mark.parametrize("kind", list(body_kinds()))
def test_bodies_fill_their_crop(kind: str) -> None:
    shape = default_shape(kind)
    for pose in shape.picture_poses:
        picture = crop(shape, pose)
        assert picture.shape == (CROP_PX, CROP_PX)
        behind = np.median(picture[[0, -1]])
        rows, columns = np.nonzero(np.abs(picture.astype(float) - behind) > 20)
        assert max(np.ptp(rows), np.ptp(columns)) + 1 == pytest.approx(FILL * CROP_PX, abs=6)
        assert (rows.min() + rows.max()) / 2 == pytest.approx((CROP_PX - 1) / 2, abs=6)
        assert (columns.min() + columns.max()) / 2 == pytest.approx((CROP_PX - 1) / 2, abs=6)


def test_sheets_are_written(tmp_path: Path) -> None:
    path = gallery.write_target_sheet(tmp_path / "g.png")
    assert cv2.imread(str(path)) is not None
    assert path.stat().st_size < 300_000
    with pytest.raises(InputError, match="does not exist"):
        gallery.write_target_sheet(tmp_path / "none" / "g.png")


def test_sheets_have_all_backgrounds_and_cameras() -> None:
    drawn = {background["kind"] for _, _, background in gallery.BACKGROUNDS}
    assert drawn == set(BACKGROUNDS.kinds) - {"recording"}  # that one needs a file of the user's
    assert [each.label.partition(":")[0] for each in gallery.cameras()] == list(PRESETS)
    assert all(each.label.endswith("mK; a drone 45 m away") for each in gallery.cameras())


@pytest.mark.slow
@pytest.mark.parametrize("make", [gallery.backgrounds, gallery.cameras])
def test_pictures_of_a_sheet_differ(make: Callable[[], Iterator[LabelledImage]]) -> None:
    pictures = [each.image.astype(float) for each in make()]
    for k, one in enumerate(pictures):
        assert one.std() > 5
        assert all(np.abs(one - other).mean() > 1 for other in pictures[:k])

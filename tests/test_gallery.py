"""The sheet of all kinds of targets."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from irsim.errors import InputError
from irsim.gallery import CROP, FILL, bodies, crop, typical, write_sheet
from irsim.shapes import SHAPES
from irsim.shapes.body import Body


def test_all_bodies_that_need_no_file_are_in_it() -> None:
    assert {name for name, kind in SHAPES if issubclass(kind, Body)} == set(bodies())


@pytest.mark.parametrize("kind", list(bodies()))
def test_a_body_fills_its_crop_and_stands_out(kind: str) -> None:
    shape = typical(kind)
    for pose in shape.poses:
        picture = crop(shape, pose)
        assert picture.shape == (CROP, CROP)
        behind = np.median(picture[[0, -1]])
        rows, columns = np.nonzero(np.abs(picture.astype(float) - behind) > 20)
        assert max(np.ptp(rows), np.ptp(columns)) + 1 == pytest.approx(FILL * CROP, abs=6)
        assert (rows.min() + rows.max()) / 2 == pytest.approx((CROP - 1) / 2, abs=6)
        assert (columns.min() + columns.max()) / 2 == pytest.approx((CROP - 1) / 2, abs=6)


def test_it_is_a_small_file(tmp_path: Path) -> None:
    path = write_sheet(tmp_path / "g.png")
    assert cv2.imread(str(path)) is not None
    assert path.stat().st_size < 300_000
    with pytest.raises(InputError, match="does not exist"):
        write_sheet(tmp_path / "none" / "g.png")

"""The sheet of all kinds of targets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from irsim.backgrounds import BACKGROUNDS
from irsim.camera.presets import PRESETS
from irsim.cli import sheets
from irsim.cli.figures import Labelled
from irsim.cli.gallery import BLIND_EACH, CROP, FILL, bodies, crop, typical, write_blind, write_sheet
from irsim.errors import InputError
from irsim.motion.attitude import Pitched, Rotorcraft, Upright
from irsim.targets import SHAPES
from irsim.targets.body import Body


def test_all_bodies_that_need_no_file_are_in_it() -> None:
    assert {name for name, kind in SHAPES if issubclass(kind, Body)} == set(bodies())


@pytest.mark.parametrize("kind", list(bodies()))
def test_a_body_fills_its_crop_and_stands_out(kind: str) -> None:
    shape = typical(kind)
    for pose in shape.picture_poses:
        picture = crop(shape, pose)
        assert picture.shape == (CROP, CROP)
        behind = np.median(picture[[0, -1]])
        rows, columns = np.nonzero(np.abs(picture.astype(float) - behind) > 20)
        assert max(np.ptp(rows), np.ptp(columns)) + 1 == pytest.approx(FILL * CROP, abs=6)
        assert (rows.min() + rows.max()) / 2 == pytest.approx((CROP - 1) / 2, abs=6)
        assert (columns.min() + columns.max()) / 2 == pytest.approx((CROP - 1) / 2, abs=6)


@pytest.mark.parametrize("kind", list(bodies()))
def test_a_pose_is_one_that_its_kind_can_be_in(kind: str) -> None:
    shape = typical(kind)
    posture = shape.posture
    for _, pitch, roll in shape.picture_poses:
        if isinstance(posture, Rotorcraft):
            assert np.cos(np.radians(pitch)) * np.cos(np.radians(roll)) >= np.cos(np.radians(posture.steepest_deg))
        elif isinstance(posture, Pitched):
            assert abs(pitch) <= posture.steepest_deg
            assert abs(roll) <= posture.bank_deg
        elif isinstance(posture, Upright):
            assert (pitch, roll) == (0, 0)


def test_it_is_a_small_file(tmp_path: Path) -> None:
    path = write_sheet(tmp_path / "g.png")
    assert cv2.imread(str(path)) is not None
    assert path.stat().st_size < 300_000
    with pytest.raises(InputError, match="does not exist"):
        write_sheet(tmp_path / "none" / "g.png")


def test_a_blind_test_has_every_kind_and_keeps_the_key_apart(tmp_path: Path) -> None:
    key = write_blind(tmp_path / "blind", 3)
    assert key.parent == tmp_path
    rows = [line.split(",") for line in key.read_text().splitlines()[1:]]
    assert sorted(kind for _, kind, *_ in rows) == sorted([*bodies()] * BLIND_EACH)
    assert [kind for _, kind, *_ in rows] != sorted(kind for _, kind, *_ in rows)
    pictures = sorted(path.name for path in (tmp_path / "blind").iterdir())
    assert pictures == sorted(name for number, *_ in rows for name in (f"{number}.png", f"{number}-large.png"))
    picture = cv2.imread(str(tmp_path / "blind" / "01.png"), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    assert picture.shape == (CROP, CROP)
    assert write_blind(tmp_path / "again", 3).read_text() == key.read_text()
    with pytest.raises(InputError, match="new folder"):
        write_blind(tmp_path / "blind", 3)


def test_sheets_leave_out_no_background_and_no_camera() -> None:
    drawn = {background["kind"] for _, _, background in sheets.BACKGROUNDS}
    assert drawn == set(BACKGROUNDS.kinds) - {"recording"}  # that one is somebody's own
    assert [each.label.partition(":")[0] for each in sheets.cameras()] == list(PRESETS)
    assert all(each.label.endswith("mK; a drone 45 m away") for each in sheets.cameras())


def test_the_drone_of_the_cameras_is_no_white_slab() -> None:
    """Its arms and its body are grey before the sky, its motors and its battery lighter."""
    *_, ideal = (each.image.astype(float) for each in sheets.cameras())
    middle = ideal[112:145, 144:177]
    drone = middle[middle > np.median(middle) + 20]
    assert drone.size > 150
    assert np.mean(drone == 255) < 0.4
    assert np.ptp(drone) > 80


@pytest.mark.parametrize("make", [sheets.backgrounds, sheets.cameras])
def test_pictures_of_a_sheet_differ(make: Callable[[], Iterator[Labelled]]) -> None:
    pictures = [each.image.astype(float) for each in make()]
    for k, one in enumerate(pictures):
        assert one.std() > 5
        assert all(np.abs(one - other).mean() > 1 for other in pictures[:k])


def test_a_sheet_is_written_under_labels(tmp_path: Path) -> None:
    path = sheets.SHEETS["cameras"](tmp_path / "cameras.png")
    picture = cv2.imread(str(path))
    assert picture is not None
    assert picture.shape[1] > picture.shape[0]

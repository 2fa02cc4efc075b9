"""Videos: decoded frames against the annotated ones."""

from __future__ import annotations

import builtins
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image, ImageSequence

import irsim
from irsim.cli.video import AMBER, PALETTE, WHITE, annotated, write_video
from irsim.render.stream import Rendering
from irsim.types import Box, Frame, TargetTruth, Truth

SCENE = """
frames: 30
camera: {size: [81, 61], rate_hz: 30, ifov_mrad: 1}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 9}, path: {kind: straight, start: [8, 20], speed: 2, range_m: 900}}]
"""


@pytest.fixture(scope="module")
def source() -> Rendering:
    return Rendering(irsim.loads(SCENE), "scene")


def expected(source: irsim.Source | Rendering, start: int, stop: int, factor: int) -> list[npt.NDArray[np.uint8]]:
    return [PALETTE[annotated(frame, truth, factor)] for frame, truth in source.pairs(start, stop, input="display")]


def test_webm_frames(source: Rendering, tmp_path: Path) -> None:
    done: list[int] = []
    path = write_video(source, tmp_path / "a.webm", 4, 20, done.append)
    assert done == list(range(1, 17))
    with av.open(path) as container:
        stream = container.streams.video[0]
        assert container.format.name == "matroska,webm"
        assert stream.codec_context.name in {"vp9", "libvpx-vp9"}
        assert stream.average_rate == 30
        found = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(found) == 16
    wanted = expected(source, 4, 20, 8)  # 81 px wide, enlarged to 640 or more
    for picture, like in zip(found, wanted, strict=True):
        assert picture.shape == (488, 648, 3)
        assert np.abs(picture.astype(float) - like).mean() < 6
    others = [np.abs(found[0].astype(float) - like).mean() for like in wanted]
    assert others.index(min(others)) == 0, "in order"
    assert found[3].min() < 10
    assert found[3].max() > 245


def test_gif_frames_bit_for_bit(source: Rendering, tmp_path: Path) -> None:
    path = write_video(source, tmp_path / "a.gif", 4, 20)
    with Image.open(path) as gif:
        found = [(np.asarray(frame.convert("RGB")), frame.info["duration"]) for frame in ImageSequence.Iterator(gif)]
        assert gif.info["loop"] == 0
    assert len(found) == 16
    for (picture, _), like in zip(found, expected(source, 4, 20, 4), strict=True):
        np.testing.assert_array_equal(picture, like)
    # 30 Hz in hundredths of a second, without drift over the whole.
    assert {lasts for _, lasts in found} == {30, 40}
    assert sum(lasts for _, lasts in found) == 530


def test_duplicated_frames_are_shown_twice(tmp_path: Path) -> None:
    doubled = Rendering(irsim.loads(SCENE, "scene", ["camera.faults=[{kind: duplicate, frames: [1, 2]}]"]), "doubled")
    for name in ("a.gif", "a.webm"):
        with av.open(write_video(doubled, tmp_path / name, 0, 6)) as container:
            assert len(list(container.decode(video=0))) == 6


def boxed(visible: float | None = None, box: Box | None = None) -> npt.NDArray[np.uint8]:
    """Return a grey frame with one target's box, enlarged 4 times."""
    frame = Frame(np.full((40, 60), 128, np.uint8), 0, 0.0, 8)
    box = box or Box(30, 20, 9, 7)
    return annotated(frame, Truth(0, 0.0, (TargetTruth("t", (box.cx, box.cy), box, visible=visible),)), 4)


def test_boxes_do_not_cover_their_target() -> None:
    picture = boxed()
    inside = picture[4 * 17 : 4 * 24, 4 * 26 : 4 * 35]
    assert (inside == round(128 * WHITE / 255)).all()
    rows, columns = np.nonzero(picture[60:130] == AMBER)
    # Box edges at 25.5 and 34.5, three px further out, from the corner of the first pixel on, four times.
    assert abs(columns.min() - 4 * (25.5 - 3 + 0.5)) <= 3
    assert abs(columns.max() - 4 * (34.5 + 3 + 0.5)) <= 3
    assert len(rows) > 200


def test_hidden_targets_have_corners_only() -> None:
    whole, hidden = ((boxed(visible)[50:120] == AMBER).sum() for visible in (0.6, 0.4))
    assert 0.2 * whole < hidden < 0.8 * whole


def test_wrong_input_writes_no_file(source: Rendering, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(irsim.InputError, match=r"allowed: \.webm, \.gif"):
        write_video(source, tmp_path / "a.avi")
    with pytest.raises(irsim.InputError, match="no frames 20:31; allowed: within 0:30"):
        write_video(source, tmp_path / "a.gif", 20, 31)
    with pytest.raises(irsim.InputError, match="the folder"):
        write_video(source, tmp_path / "no" / "a.gif", 0, 1)
    real = builtins.__import__

    def without_av(name: str, *rest: Any, **named: Any) -> Any:
        if name == "av":
            raise ImportError(name)
        return real(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without_av)
    with pytest.raises(irsim.InputError, match=r"pip install 'irtrack\[video\]'"):
        write_video(source, tmp_path / "a.webm", 0, 2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".gif", ".webm"])
def test_a_failing_source_keeps_the_old_file(ending: str, tmp_path: Path) -> None:
    class Broken(Rendering):
        def pairs(self, *args: Any, **named: Any) -> Any:
            yield from super().pairs(0, 2, input="display")
            raise irsim.InputError("frame 2 is damaged")

    path = tmp_path / f"a{ending}"
    path.write_bytes(b"old")
    with pytest.raises(irsim.InputError, match="damaged"):
        write_video(Broken(irsim.loads(SCENE), "broken"), path, 0, 5)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]

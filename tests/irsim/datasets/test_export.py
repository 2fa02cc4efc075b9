"""Data sets: each format holds what it can of a clip, and splits, cards and masks."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest

import irsim
from irsim.datasets import CARD, export_dataset
from irsim.datasets.splits import split_names
from irsim.errors import InputError
from irsim.recording.formats import WRITERS
from irsim.recording.formats.base import clipped
from irsim.recording.formats.coco import run_lengths
from irsim.recording.formats.folder import DatasetFolder
from irsim.recording.importers import import_frames
from irsim.render.stream import Rendering
from irsim.types import TargetTruth, Truth

SIZE = (48, 40)
SCENE = """\
seed: 3
frames: 8
camera: {size: [48, 40], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
follow: bird
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [40, 20], speed: 1.5, range_m: 1500}}
  - {id: bird, shape: {kind: point, temperature_k: 400, area_m2: 0.5},
     path: {kind: straight, start: [9, 8], speed: 1.7, range_m: 2000}}
occluders:
  - {kind: bar, center_px: [16, 8], size_px: [12, 30], range_m: 300}
"""
"""A jet that leaves the picture, and a bird that passes behind a bar."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "two.yaml"
    path.write_text(SCENE)
    return path


class Held(NamedTuple):
    """What a format holds of a clip, and where."""

    pictures: str
    labels: str
    ids: Callable[[str], str | None] = str
    cls: bool = True
    visible: bool = False
    clip: bool = False
    follow: bool = False
    lossless: bool = True


def number(name: str) -> str:
    return {"jet": "target-1", "bird": "target-2"}[name]


def by_class(name: str) -> str:
    return {"jet": "fighter-1", "bird": "point-1"}[name]


FORMATS = {
    "coco": Held("images/train", "annotations/train.json", clip=True),
    "yolo": Held("images/train", "labels/train", ids=by_class, clip=True),
    "mot": Held("train/two/img1", "train/two/gt/gt.txt", ids=number, visible=True),
    "vot": Held("sequences/two/ir", "sequences/two", ids=lambda _: "target", cls=False, follow=True),
    "anti-uav": Held("two", "two/IR_label.json", ids=lambda _: "target", cls=False, follow=True, lossless=False),
    "png": Held("two", "two/truth.csv"),
    "npz": Held("two.npz", "two.csv"),
    "mp4": Held("two.mp4", "two.csv", lossless=False),
    "ros2": Held("two", "two"),
}


def picture(path: Path) -> np.ndarray:
    found = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return found


def labelled(truth: Truth, held: Held) -> list[TargetTruth]:
    """Return the labels that a format holds of a frame's truth."""
    columns, rows = SIZE
    found = []
    for target in truth.targets:
        box = target.box
        apart = box.right <= -0.5 or box.left >= columns - 0.5 or box.bottom <= -0.5 or box.top >= rows - 0.5
        seen = target.visible is not None and target.visible >= 0.1
        if seen and not apart and (target.id == "bird" or not held.follow):
            found.append(replace(target, box=clipped(box, SIZE) if held.clip else box))
    return found


@pytest.mark.parametrize("format", FORMATS)
def test_import_of_an_export_is_the_clip(format: str, scene: Path, tmp_path: Path) -> None:
    """Pictures, boxes, ids and classes come back as far as the format holds them."""
    if (needs := WRITERS[format].needs) is not None:
        pytest.importorskip(needs[0])
    held, source = FORMATS[format], Rendering(irsim.load(scene))
    out = export_dataset([scene], tmp_path / "set", format)
    read = irsim.open_recording(
        import_frames(out / held.pictures, tmp_path / "r.mcap", truth=out / held.labels, rate_hz=30)
    )
    assert len(read) == len(source) == 8
    hidden = outside = 0
    for (frame, truth), (came, found) in zip(source.pairs(input=WRITERS[format].inputs[0]), read.pairs(), strict=True):
        if held.lossless:
            assert np.array_equal(came.image, frame.image)
        else:
            assert np.abs(came.image.astype(float) - frame.image).mean() < 3
        expected = labelled(truth, held)
        hidden += sum(target.hidden for target in truth.targets)
        outside += sum(target.box.right > SIZE[0] - 0.5 for target in truth.targets)
        assert found is not None
        assert [target.id for target in found.targets] == [held.ids(target.id) for target in expected]
        assert [target.cls for target in found.targets] == [target.cls if held.cls else None for target in expected]
        for one, other in zip(found.targets, expected, strict=True):
            assert (one.box.cx, one.box.cy) == pytest.approx((other.box.cx, other.box.cy), abs=1e-6)
            assert (one.box.w, one.box.h) == pytest.approx((other.box.w, other.box.h), abs=1e-6)
            assert one.visible == (pytest.approx(other.visible, abs=1e-6) if held.visible else None)
    assert hidden > 0
    assert outside > 0


def test_import_of_exported_masks_gives_their_parts(scene: Path, tmp_path: Path) -> None:
    """A pixel belongs to a body that visibly covers half of it, and to a point within half of its maximum."""
    out = export_dataset([scene], tmp_path / "set", "sirst")
    scenario = irsim.load(scene)
    names = (out / "img_idx" / "train_set.txt").read_text().split()
    assert names == [f"two_{index:06}" for index in range(8)]
    read = irsim.open_recording(import_frames(out / "images", tmp_path / "r.mcap", truth=out / "masks", rate_hz=30))
    for name, exact, truth in zip(names, irsim.masks(scenario), read.truths(), strict=True):
        mask = picture(out / "masks" / f"{name}.png")
        jet = exact["jet"].visible >= 0.5
        bird = exact["bird"].visible >= 0.5 * exact["bird"].whole.max()
        assert np.array_equal(mask, 255 * (jet | bird))
        assert len(truth.targets) == int(jet.any()) + int(bird.any())
        for target in truth.targets:
            x, y, w, h = map(int, target.box.pixels)
            part = mask[y : y + h, x : x + w]
            assert part.any(axis=0).all()
            assert part.any(axis=1).all()


def test_run_lengths_of_a_mask() -> None:
    """Down the columns, zeros first: 0 1 0 / 1 1 0 has 0 1 1 1 0 0 in order."""
    assert run_lengths(np.array([[0, 1, 0], [1, 1, 0]], bool)) == [1, 3, 2]
    assert run_lengths(np.array([[1, 0], [0, 0]], bool)) == [0, 1, 3]
    assert run_lengths(np.zeros((2, 2), bool)) == [4]


def test_masks_of_a_recording_are_those_of_its_scenario(scene: Path, tmp_path: Path) -> None:
    recording = irsim.record(Rendering(irsim.load(scene), "two"), tmp_path / "two.mcap", 2, 6)
    whole, part = (export_dataset([each], tmp_path / name, "coco") for each, name in ((scene, "a"), (recording, "b")))
    one, two = (json.loads((out / "annotations" / "train.json").read_text()) for out in (whole, part))
    cut = [each for each in one["annotations"] if 3 <= each["image_id"] <= 6]
    keys = ("bbox", "area", "segmentation", "category_id")
    assert [[each[key] for key in keys] for each in two["annotations"]] == [[each[key] for key in keys] for each in cut]
    folder = tmp_path / "frames"
    folder.mkdir()
    cv2.imwrite(str(folder / "0.png"), np.zeros((8, 8), np.uint8))
    (tmp_path / "t.csv").write_text("frame,x,y,w,h\n0,1,1,2,2\n")
    imported = import_frames(folder, tmp_path / "i.mcap", truth=tmp_path / "t.csv")
    with pytest.raises(InputError, match="masks need a scenario"):
        export_dataset([imported], tmp_path / "c", "sirst")
    boxes = json.loads((export_dataset([imported], tmp_path / "d", "coco") / "annotations/train.json").read_text())
    assert boxes["annotations"][0]["segmentation"] == []


def test_splits_hold_whole_clips(scene: Path, tmp_path: Path) -> None:
    out = export_dataset([scene], tmp_path / "set", "coco", seeds=5, split=(0.6, 0.2, 0.2))
    places = {path.name.rpartition("_")[0]: set() for path in out.glob("images/*/*.png")}  # type: dict[str, set[str]]
    for path in out.glob("images/*/*.png"):
        places[path.name.rpartition("_")[0]].add(path.parent.name)
    assert sorted(places) == [f"two-s{seed}" for seed in range(5)]
    assert all(len(splits) == 1 for splits in places.values())
    splits = [split for (split,) in places.values()]
    assert [splits.count(name) for name in ("train", "val", "test")] == [3, 1, 1]
    for split in ("train", "val", "test"):
        images = json.loads((out / "annotations" / f"{split}.json").read_text())["images"]
        assert {each["file_name"] for each in images} == {path.name for path in (out / "images" / split).iterdir()}


@pytest.mark.parametrize(
    ("count", "shares", "expected"),
    [
        (10, (0.8, 0.1, 0.1), [8, 1, 1]),
        (3, (0.8, 0.1, 0.1), [1, 1, 1]),
        (7, (0.5, 0.5), [4, 3]),
        (4, (0.9, 0, 0.1), [3, 0, 1]),
    ],
)
def test_sizes_of_splits(count: int, shares: tuple[float, ...], expected: list[int]) -> None:
    names = [f"clip-{index}" for index in range(count)]
    found = split_names(names, shares)
    assert [found.count(split) for split in ("train", "val", "test")][: len(expected)] == expected
    assert dict(zip(names[::-1], split_names(names[::-1], shares), strict=True)) == dict(zip(names, found, strict=True))


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_card_says_what_made_the_set(jobs: int, scene: Path, tmp_path: Path) -> None:
    """The same command gives the same digests, also with two processes."""
    cards = []
    for name, number in (("one", 1), ("two", jobs)):
        out = export_dataset([scene], tmp_path / name, "png", seeds=2, jobs=number, command="irsim export two.yaml")
        cards.append(json.loads((out / CARD).read_text()))
    assert cards[0] == cards[1]
    card = cards[0]
    assert (card["complete"], card["missing"], card["command"]) == (True, [], "irsim export two.yaml")
    assert card["versions"]["irsim"] == irsim.__version__
    assert [(clip["name"], clip["seed"], clip["frames"]) for clip in card["whole"]] == [
        ("two-s0", 0, 8),
        ("two-s1", 1, 8),
    ]
    assert card["whole"][1]["scene"] == Rendering(irsim.load(scene)).with_seed(1).hash


def test_full_disk_leaves_whole_clips(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The write that fails leaves no file; the card lists the clip before it."""
    write = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if path.name == "000003.png" and path.parent.name == "two-s1":
            write(path, data[:20])
            raise OSError(28, "No space left on device")
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match=r"000003\.png: cannot be written: No space left on device"):
        export_dataset([scene], tmp_path / "set", "png", seeds=3)
    card = json.loads((tmp_path / "set" / CARD).read_text())
    assert not card["complete"]
    assert [clip["name"] for clip in card["whole"]] == ["two-s0"]
    assert card["missing"] == ["two-s1", "two-s2"]
    assert not (tmp_path / "set" / "two-s1" / "000003.png").exists()


def test_only_targets_that_are_visible_enough_have_labels(scene: Path, tmp_path: Path) -> None:
    truths = list(Rendering(irsim.load(scene)).truths())
    for least in (0.2, 0.8):
        out = export_dataset([scene], tmp_path / f"{least}", "mot", min_visible=least)
        rows = [line.split(",") for line in (out / "train/two/gt/gt.txt").read_text().splitlines()]
        expected = [
            (truth.index + 1, target.id)
            for truth in truths
            for target in labelled(truth, FORMATS["mot"])
            if (target.visible or 0) >= least
        ]
        assert [(int(row[0]), ["jet", "bird"][int(row[1]) - 1]) for row in rows] == expected


@pytest.mark.parametrize("format", ["coco", "mot"])
def test_first_frames_of_a_clip_are_those_of_the_whole(format: str, scene: Path, tmp_path: Path) -> None:
    """Unlike the override `frames=3`, this takes scenes whose events lie beyond."""
    whole = export_dataset([scene], tmp_path / "whole", format)
    part = export_dataset([scene], tmp_path / "part", format, frames=3)
    pictures = sorted(path.relative_to(part) for path in part.rglob("*.png"))
    assert len(pictures) == 3
    assert all((part / each).read_bytes() == (whole / each).read_bytes() for each in pictures)
    assert json.loads((part / CARD).read_text())["whole"][0]["frames"] == 3


def test_a_suite_gives_its_scenes(scene: Path, tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(SCENE)
    (tmp_path / "x-suite.yaml").write_text(
        "sources: [two.yaml, {source: two.yaml, name: calm, changes: {frames: 3}}]\ntrackers: [kalman]\nseeds: 2\n"
    )
    out = export_dataset([tmp_path / "x-suite.yaml"], tmp_path / "set", "npz")
    clips = json.loads((out / CARD).read_text())["whole"]
    expected = [("two-s0", 8), ("two-s1", 8), ("calm-s0", 3), ("calm-s1", 3)]
    assert [(clip["name"], clip["frames"]) for clip in clips] == expected


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"format": "coc"}, r"format 'coc': allowed: coco, .*; did you mean 'coco'\?"),
    ({"format": "anti-uav", "input": "counts"}, "input counts: anti-uav holds 8-bit pictures; allowed: display"),
    ({"split": (0.8, 0.1, 0.1)}, "split 0.8,0.1,0.1: 1 clip for 3 splits"),
    ({"split": (0.8, 0.3)}, r"split 0.8,0.3: allowed: shares .* that add up to 1"),
    ({"seeds": 0}, "seeds 0: allowed: 1 or more"),
    ({"frames": 0}, "frames 0: allowed: 1 or more"),
    ({"min_visible": 1.5}, "min_visible 1.5: allowed: a number from 0 to 1"),
    ({"twice": True}, "a clip of .*two.yaml is called two already"),
]


@pytest.mark.parametrize(("options", "message"), WRONG)
def test_wrong_options(options: dict[str, Any], message: str, scene: Path, tmp_path: Path) -> None:
    sources = [scene] * (2 if options.pop("twice", False) else 1)
    with pytest.raises(InputError, match=message) as error:
        export_dataset(sources, tmp_path / "set", **{"format": "coco", **options})
    assert "\n" not in str(error.value)
    assert not (tmp_path / "set").exists()


def test_classes_that_differ_in_case_collide(scene: Path, tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(
        SCENE.replace("id: jet,", "id: jet, cls: Bird,").replace("id: bird,", "id: bird, cls: bird,")
    )
    with pytest.raises(InputError, match="classes 'Bird' and 'bird' collide"):
        export_dataset([tmp_path / "two.yaml"], tmp_path / "set", "yolo")


def test_a_folder_in_use_is_refused(scene: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds 1 file, such as mine\.txt; allowed: an empty folder"):
        export_dataset([scene], tmp_path, "png")


def test_pictures_of_16_bit_keep_their_counts(tmp_path: Path) -> None:
    counts = np.random.default_rng(0).integers(0, 65536, (30, 40)).astype(np.uint16)
    DatasetFolder(tmp_path).picture("a/b.png", counts)
    assert np.array_equal(picture(tmp_path / "a" / "b.png"), counts)

"""The hash of a scenario follows the code that renders it."""

from __future__ import annotations

import base64
import hashlib
import pickle
import subprocess
import sys
from pathlib import Path

import pytest
from test_floor_plan import plan

import irsim
from irsim import crew
from irsim.identity import NOT_PIXELS
from irsim.scenario import ABOUT, Scenario

KIND = """
from irsim.motion.straight import Straight

class Mine(Straight):
    pass
"""
SCENE = """
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, temperature_k: 400}, path: {kind: "KIND", start: [60, 20], range_m: 3000}}
"""


def test_the_hash_follows_the_code_of_a_users_own_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "hashed_kind.py"
    file.write_text(KIND)
    scene = irsim.loads(SCENE.replace("KIND", "hashed_kind:Mine"))
    plain = irsim.loads(SCENE.replace("KIND", "straight"))
    first, other = scene.hash, plain.hash
    assert first != other
    file.write_text(KIND + "# mended\n")
    assert scene.hash != first
    assert plain.hash == other
    file.write_text(KIND)
    assert scene.hash == first


WORDS = {"errors", "cards", "wording"}
"""Rooms that those of a frame import for what they say of it, and of what is wrong."""

ABOUT_ONLY = {"expectation": "expect", "variation": "vary"}
"""Rooms whose values a scenario holds, each under a key that changes no pixel."""

SPREAD = {"crew", "balance", "division", "interrupts", "places", "worker"}
"""Rooms that share frames out among processes."""


def reached(start: str, *cut: str) -> set[str]:
    """The rooms that one imports, by way of others too, itself among them; not through those that are cut."""
    rooms, waiting, imports = set[str](), [start], plan("irsim")
    while waiting:
        room = waiting.pop()
        if room not in rooms:
            rooms.add(room)
            waiting += imports[room] - set(cut)
    return rooms


def test_the_hash_covers_the_rooms_that_a_frame_comes_through_and_no_others() -> None:
    rooms = reached("simulate", "loader", "crew")  # to write the scenario down, and for frames that others draw
    assert {"render", "motion", "detector", "display"} <= rooms
    assert set(plan("irsim")) - rooms | WORDS | set(ABOUT_ONLY) == NOT_PIXELS
    assert reached("simulate", "loader") - rooms == SPREAD
    assert "shelf" in rooms - NOT_PIXELS


def test_what_a_scene_may_be_and_is_for_is_read_by_no_room_of_a_frame() -> None:
    """Only the scenario holds it, under keys that its hash leaves out."""
    rooms = reached("simulate", "loader", "crew")
    for room, key in ABOUT_ONLY.items():
        assert [each for each in sorted(rooms) if room in plan("irsim")[each]] == ["scenario"]
        assert key in ABOUT
        assert room.capitalize() in repr(Scenario.model_fields[key].annotation)


ALONE = """
import base64, hashlib, pickle, sys
for room in ROOMS:
    sys.modules[f"irsim.{room}"] = None  # importing it raises
from irsim.render import Renderer
renderer = Renderer(pickle.loads(base64.b64decode(sys.stdin.read())))
for index in INDICES:
    frame, truth = renderer.frame(index)
    print(hashlib.sha256(frame.image.tobytes() + repr((frame.time, truth)).encode()).hexdigest())
"""


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "count"), [("sky", 128), ("sea", 12), ("correction", 80), ("glare", 8)])
def test_frames_are_the_same_without_the_rooms_that_are_left_out(
    name: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drawn by a process that cannot import them, alone and backwards, and in order by two processes: whole frames by
    each, or, from LONG frames on, parts of each."""
    monkeypatch.setattr(crew, "LONG", 128)
    scenario = irsim.load(name)
    indices = (count - 1, count // 2, 0)
    blocked = sorted(NOT_PIXELS - WORDS - set(ABOUT_ONLY) - {"lazy"})  # by that all of irsim is reached
    code = ALONE.replace("ROOMS", repr(blocked)).replace("INDICES", repr(indices))
    text = base64.b64encode(pickle.dumps(scenario)).decode()
    done = subprocess.run([sys.executable, "-c", code], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    spread = {frame.index: (frame, truth) for frame, truth in irsim.frames(scenario, stop=count, jobs=2)}
    told = [
        hashlib.sha256(frame.image.tobytes() + repr((frame.time, truth)).encode()).hexdigest()
        for frame, truth in map(spread.__getitem__, indices)
    ]
    assert done.stdout.split() == told

"""The hash of a scenario follows the code that renders it."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_floor_plan import plan

import irsim
from irsim.identity import NOT_PIXELS

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


def test_the_hash_covers_the_rooms_that_a_frame_comes_through_and_no_others() -> None:
    rooms, waiting = set[str](), ["simulate"]
    imports = plan("irsim")
    while waiting:
        room = waiting.pop()
        if room not in rooms:
            rooms.add(room)
            waiting += imports[room] - {"loader"}  # only to write the scenario down
    assert {"render", "motion", "detector", "display"} <= rooms
    only_words = {"errors", "cards"}
    assert (set(imports) - rooms) | only_words == NOT_PIXELS

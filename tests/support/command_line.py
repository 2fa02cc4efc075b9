"""Scenes, a tracker's file and answers, for the tests of commands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


class Answer(NamedTuple):
    status: int
    out: str
    err: str


Run = Callable[..., Done]
"""irsim: `run("check", "sky", cwd=folder)`."""
Call = Callable[..., Answer]
"""irtrack: `call("run", "kalman", "clip.mcap")`."""

SMALL_SCENE = """\
seed: 3
frames: 6
camera: {size: [48, 32], noise: [{kind: white}]}
background: {kind: sky}
targets:
  - id: jet
    shape: {kind: point, temperature_k: 600}
    path: {kind: straight, start: [10, 16], speed: 2}
"""
IRSIM = [sys.executable, "-m", "irsim"]
"""The command irsim, as a process of its own."""

SCENE_OF_TWO = """
seed: 3
frames: 20
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [30, 36], speed: 1, range_m: 3000}}
  - {id: bird, shape: {kind: point, temperature_k: 400}, path: {kind: straight, start: [60, 20], range_m: 3000}}
"""
OWN_TRACKERS = """
import os

from irtrack.types import Estimate

class Broken:
    resumable = True
    def init(self, frame, box, rng):
        return box
    def step(self, state, frame, rng):
        raise ValueError("planted")

class Careless(Broken):
    what = "none"
    def step(self, state, frame, rng):
        print("seen", frame.index)
        if self.what == "leave":
            raise SystemExit(3)
        if self.what == "die":
            os._exit(3)
        if self.what == "command":
            raise ValueError("\\x1b[31m<b>red\\x9b0m \\x07\\u202e \\x00 \\udc9b")
        if self.what == "write":
            frame.image[0, 0] = 1
        return {"none": None, "pair": (state.cx, state.cy), "good": (state, Estimate((9, 9), (5, 5)))}[self.what]
    def __init__(self, what="none"):
        self.what = what

class Typed(Broken):
    def __init__(self, reach: int = 3):
        self.reach = reach

class Reaching(Broken):
    def __init__(self, reach=1.0):
        self.reach = reach
    def step(self, state, frame, rng):
        return state, Estimate((state.cx, state.cy), (state.w, state.h))
"""
"""A user's mine.py: trackers, most of which fail, each in its way."""

"""Hypothesis strategies for the parts of scenes, as mappings.

Severities go from 0, no effect, to 5, more than most trackers survive. Tables hold the parameter at each severity.
Values are those of the shipped scenarios `stress/...`, except for `HIDING`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from irsim.camera.presets import PRESETS

Part = dict[str, Any]

TOP = 5
"""The highest severity."""

SPEEDS = (0.0, 0.3, 0.6, 1.0, 1.5, 2.0)
"""Speeds of a target, px per frame."""
TURNS = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Sharpest turns, degrees per frame."""
WEAVES = (0.0, 1.0, 2.0, 4.0, 6.0, 8.0)
"""Amplitudes of weaves, px."""
NETD_MK = (20.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0)
CLUTTER = (0.0, 0.002, 0.004, 0.008, 0.016, 0.03)
"""False targets in a square milliradian."""
COVERAGE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
"""Fraction of the sky covered by cloud."""
HIDING = ((0.0, 0), (0.5, 5), (0.8, 8), (1.0, 8), (1.0, 12), (1.0, 16))
"""Occluded fraction of a target, and number of frames. The frames are fewer than in `stress/occlusion`, as these scenes
are short."""
ANGLES = (90.0, 90.0, 50.0, 25.0, 12.0, 6.0)
"""Angle between crossing trajectories, degrees."""
FAULT_RATES = (0.0, 0.05, 0.15, 0.3, 0.5, 0.7)
SHAKE_PX = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0)
NEAREST = (0.0, 40.0, 32.0, 24.0, 18.0, 14.0)
"""Distance of a decoy from the target, px."""


def severities(top: int = TOP) -> SearchStrategy[int]:
    """Return a strategy of integers 0 .. top, which shrink to 0."""
    return st.integers(0, top)


Severity = SearchStrategy[int]
ANY = severities()
"""Strategy of all severities, the default of the strategies below."""


def seeds() -> SearchStrategy[int]:
    """Return a strategy of scene seeds; draw them last, since a smaller seed is not milder."""
    return st.integers(0, 2**31 - 1)


def straight(pace: float, heading: float, size: Sequence[int], frames: int, range_m: float = 1000.0) -> Part:
    """Return a straight path through the middle of the picture, reached in the middle frame.

    pace     px per frame
    heading  degrees
    size     (columns, rows), px
    """
    turn = math.radians(heading)
    start = [
        round((side - 1) / 2 - pace * part * (frames - 1) / 2, 3)
        for side, part in zip(size, (math.cos(turn), math.sin(turn)), strict=True)
    ]
    return {"kind": "straight", "start": start, "speed": pace, "heading_deg": heading, "range_m": range_m}


@st.composite
def straights(
    draw: st.DrawFn,
    size: Sequence[int] = (96, 72),
    frames: int = 30,
    speed: Severity = ANY,
    range_m: float = 1000.0,
) -> Part:
    """Draw a `straight` path. `speed` draws the index into `SPEEDS`; at 0 the target stands still."""
    pace = SPEEDS[draw(speed)]
    return straight(pace, 45.0 * draw(st.integers(0, 7)), size, frames, range_m)


@st.composite
def weaves(
    draw: st.DrawFn,
    size: Sequence[int] = (96, 72),
    frames: int = 30,
    speed: Severity = ANY,
    amplitude: Severity = ANY,
    range_m: float = 1000.0,
) -> Part:
    """Draw a sinusoid about a straight path. `amplitude` draws the index into `WEAVES`; at 0 the path is straight."""
    way = draw(straights(size, frames, speed, range_m))
    height = WEAVES[draw(amplitude)]
    return {**way, "kind": "weave", "amplitude_px": height, "period_frames": 24.0}


@st.composite
def manoeuvres(
    draw: st.DrawFn,
    size: Sequence[int] = (96, 72),
    frames: int = 30,
    speed: Severity = ANY,
    turn: Severity = ANY,
    range_m: float = 1000.0,
) -> Part:
    """Draw a path of random turns. `turn` draws the index into `TURNS`; at 0 the path is straight."""
    way = draw(straights(size, frames, speed, range_m))
    sharpest = TURNS[draw(turn)]
    return {**way, "kind": "manoeuvre", "turn_deg": sharpest, "hold_frames": 12.0}


def paths(size: Sequence[int] = (96, 72), frames: int = 30, range_m: float = 1000.0) -> SearchStrategy[Part]:
    """Return a strategy of straight, weaving and turning paths, which shrink to a target at rest."""
    return st.one_of(
        straights(size, frames, range_m=range_m),
        weaves(size, frames, range_m=range_m),
        manoeuvres(size, frames, range_m=range_m),
    )


@st.composite
def shapes(draw: st.DrawFn) -> Part:
    """Draw a target shape about 15 px wide at 1000 m and 0.5 mrad; the simplest is a uniform patch."""
    kinds = {"hot_spot": 0, "fighter": 7.0, "car": 5.0, "boat": 8.0, "quadrotor": 5.0, "point": 0}
    kind = draw(st.sampled_from(list(kinds)))
    if kind == "hot_spot":
        return {"kind": kind, "size_m": [7.0, 5.0], "temperature_k": 305.0}
    if kind == "point":
        return {"kind": kind, "area_m2": 1.0, "temperature_k": 500.0}
    return {"kind": kind, "length_m": kinds[kind], "temperature_k": 305.0}


@st.composite
def noises(draw: st.DrawFn, severity: Severity = ANY) -> Part:
    """Draw keys of a camera: its NETD, from `NETD_MK`, and its noise terms; the simplest is white noise alone."""
    netd = NETD_MK[draw(severity)]
    terms: tuple[Part, ...] = (
        {"kind": "fixed_pattern"},
        {"kind": "ar1", "rho": 0.9},
        {"kind": "noise_3d", "tv": 0.3, "th": 0.3},
    )
    further = draw(st.lists(st.sampled_from(terms), max_size=2, unique_by=lambda term: str(term["kind"])))
    return {"netd_mk": netd, "noise": [{"kind": "white"}, *further]}


@st.composite
def clutters(draw: st.DrawFn, severity: Severity = ANY) -> Part:
    """Draw a background of ground with false targets at a density from `CLUTTER`; at severity 0 it is uniform."""
    step = draw(severity)
    ground = {"kind": "ground", "mean_k": 285.0, "spread_k": 0.2 * step}
    if step == 0:
        return ground
    things = {"per_mrad2": CLUTTER[step], "size_mrad": [3.0, 7.0], "contrast_k": [3.0, 10.0], "cold": 0.2}
    return {**ground, "clutter": things}


@st.composite
def skies(draw: st.DrawFn, severity: Severity = ANY) -> Part:
    """Draw a background of sky with a cloud cover from `COVERAGE`; at severity 0 it is uniform."""
    step = draw(severity)
    sky = {"kind": "sky", "horizon_k": 285.0, "zenith_k": 285.0}
    return sky if step == 0 else {**sky, "clouds": [{"coverage": COVERAGE[step], "temperature_k": 290.0}]}


@st.composite
def countries(draw: st.DrawFn) -> Part:
    """Draw a background of ground or landscape, with given temperatures or those of an hour. Behind trees the horizon
    is bare, wooded, or the default. The simplest is uniform ground."""
    kind, mean = draw(st.sampled_from([("ground", "mean_k"), ("landscape", "ground_k")]))
    country: Part = {"kind": kind, "spread_k": draw(st.sampled_from([0.0, 2.0, 3.0])), mean: 290.0}
    hour = draw(st.sampled_from(["any", "day", "night"]))
    if hour != "any":
        left_out = draw(st.sets(st.sampled_from(["spread_k", mean])))
        country = {"hour": hour, **{key: value for key, value in country.items() if key not in left_out}}
    if kind == "landscape" and draw(st.booleans()):
        country["trees"] = [{"range_m": 800.0}]
    woods = draw(st.sampled_from([None, 0.0, 2.0])) if kind == "landscape" else None
    return country if woods is None else {**country, "far_woods_mrad": woods}


@st.composite
def cameras(draw: st.DrawFn) -> Part:
    """Draw keys of a camera: a preset or none, some further keys and, where these keys permit, a detector. The simplest
    is the default camera."""
    plain = {"bits": 14, "netd_mk": 40.0, "time_constant_ms": 0.0, "noise": [{"kind": "white"}], "correction": None}
    own = draw(st.sets(st.sampled_from(sorted(plain))))
    preset = draw(st.sampled_from([None, *PRESETS]))
    any_detector = st.sampled_from([None, "stated", "electrons"])
    detector = draw(any_detector) if preset is None or "noise" in own else None
    camera: Part = {key: plain[key] for key in sorted(own)}
    if preset is not None:
        camera["preset"] = preset
    return camera if detector is None else {**camera, "detector": {"kind": detector}}


@st.composite
def occlusions(draw: st.DrawFn, target: str = "target", frames: int = 30, severity: Severity = ANY) -> list[Part]:
    """Draw smoke that hides `target` about the middle of the scene, as in `HIDING`; at severity 0 there is none.

    Unlike a wall, smoke can come and go before a target at rest.
    """
    fraction, length = HIDING[draw(severity)]
    if length == 0:
        return []
    first = max(frames // 2 - length // 2, 1)
    last = min(first + length - 1, frames - 2)
    smoke = {"kind": "smoke", "id": "screen", "hides": target, "frames": [first, last], "fraction": fraction}
    return [{**smoke, "grow_frames": 1.0, "fade_frames": 1.0, "range_m": 300.0, "temperature_k": 287.0}]


@st.composite
def crossings(
    draw: st.DrawFn,
    target: str = "target",
    frames: int = 30,
    shape: Part | None = None,
    severity: Severity = ANY,
) -> list[Part]:
    """Draw another target that crosses `target` in mid-scene at one of `ANGLES`; at severity 0 there is none."""
    step = draw(severity)
    if step == 0:
        return []
    way = {"kind": "crosses", "target": target, "at_frame": frames // 2, "speed": 1.5, "angle_deg": ANGLES[step]}
    return [{"id": "crosser", "cls": "decoy", "shape": shape or HOT_SPOT, "path": way}]


@st.composite
def decoys(
    draw: st.DrawFn,
    path: Part,
    shape: Part | None = None,
    severity: Severity = ANY,
) -> list[Part]:
    """Draw a decoy on a path parallel to the target's, at the distance `NEAREST[severity]` px; severity 0: no decoy."""
    step = draw(severity)
    if step == 0:
        return []
    angle = math.radians(path["heading_deg"] + 90.0 * draw(st.sampled_from([1, -1])))
    start = [
        round(place + NEAREST[step] * part, 3)
        for place, part in zip(path["start"], (math.cos(angle), math.sin(angle)), strict=True)
    ]
    return [{"id": "like", "cls": "decoy", "shape": shape or HOT_SPOT, "path": {**path, "start": start}}]


@st.composite
def frame_faults(draw: st.DrawFn, severity: Severity = ANY) -> list[Part]:
    """Draw frame loss: frames dropped or doubled at a rate from `FAULT_RATES`; at severity 0 there is none."""
    rate = FAULT_RATES[draw(severity)]
    return [] if rate == 0 else [{"kind": draw(st.sampled_from(["drop", "duplicate"])), "rate": rate}]


@st.composite
def camera_motions(draw: st.DrawFn, severity: Severity = ANY) -> list[Part]:
    """Draw camera shake of an rms from `SHAKE_PX`; at severity 0 there is none."""
    rms = SHAKE_PX[draw(severity)]
    return [] if rms == 0 else [{"kind": "shake", "rms_px": rms}]


HOT_SPOT: Part = {"kind": "hot_spot", "size_m": [7.0, 5.0], "temperature_k": 305.0}
"""Uniform patch to which `shapes` shrinks."""

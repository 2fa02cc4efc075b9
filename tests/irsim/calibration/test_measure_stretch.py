"""Repeated frames do not count, and a fixed pattern that changes is told from all else that does."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from frame_folders import folder_of
from intervals import held
from typer.testing import CliRunner

from irsim import import_frames
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.measure import NoiseReport, Region, measure_noise, noise_lines
from irsim.measure.repeats import new_frames
from irsim.measure.steps import pattern_steps
from irsim.measure.stretch import Breaks
from irsim.types import Floats

REAL = Path(__file__).resolve().parents[4] / "shared" / "real"
real = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")

SIGMA, PIXEL, RHO = 10.0, 6.0, 0.85
SIDE = 48
SEEDS = 20
WHOLE = Region(0, 0, SIDE, SIDE)


def noise(rng: np.random.Generator, count: int, rho: float = 0.0) -> Floats:
    """White noise of SIGMA, or as strong AR(1) noise (count, SIDE, SIDE)."""
    drawn = rng.normal(0, SIGMA, (count, SIDE, SIDE))
    for k in range(1, count):
        drawn[k] = rho * drawn[k - 1] + np.sqrt(1 - rho**2) * drawn[k]
    return np.asarray(drawn)


def patterns(rng: np.random.Generator, count: int, *steps: int) -> Floats:
    """A fixed pattern of PIXEL, drawn anew at each step."""
    drawn = rng.normal(1000, PIXEL, (len(steps) + 1, SIDE, SIDE))
    return np.asarray(drawn[np.searchsorted(steps, np.arange(count), side="right")])


def frozen(frames: Floats, first: int, count: int) -> Floats:
    """Frames of which `count` from `first` on show the one before."""
    shown = frames.copy()
    shown[first : first + count] = frames[first - 1]
    return shown


def corrected(rng: np.random.Generator) -> Floats:
    return noise(rng, 80) + patterns(rng, 80, 30)


def corrected_twice(rng: np.random.Generator) -> Floats:
    return noise(rng, 120) + patterns(rng, 120, 30, 90)


def corrected_behind_a_shutter(rng: np.random.Generator) -> Floats:
    return frozen(corrected(rng), 30, 15)


def shut(rng: np.random.Generator) -> Floats:
    return frozen(noise(rng, 80) + patterns(rng, 80), 30, 15)


def doubled(rng: np.random.Generator) -> Floats:
    frames = noise(rng, 80) + patterns(rng, 80)
    return np.repeat(frames, np.where(rng.random(80) < 0.3, 2, 1), axis=0)


def lossy(rng: np.random.Generator) -> Floats:
    frames = noise(rng, 100) + patterns(rng, 100)
    return frames[rng.random(100) > 0.2]


SPOILT: dict[Callable[[np.random.Generator], Floats], tuple[tuple[int, ...], int | None]] = {
    corrected: ((30,), 0),
    corrected_twice: ((30, 90), 0),
    corrected_behind_a_shutter: ((45,), 15),
    shut: ((), 15),
    doubled: ((), None),
    lossy: ((), 0),
}
"""What happens to a recording: the steps that are seen, and the repeats, where they are the same for all seeds."""


@lru_cache
def reports(spoil: Callable[[np.random.Generator], Floats]) -> tuple[NoiseReport, ...]:
    return tuple(measure_noise(spoil(np.random.default_rng(seed)), 30.0, WHOLE) for seed in range(SEEDS))


SLOWER = (corrected_twice, doubled, lossy)


@pytest.mark.sampled
@pytest.mark.parametrize(
    "spoil", [pytest.param(spoil, marks=[pytest.mark.slow] if spoil in SLOWER else []) for spoil in SPOILT]
)
def test_what_went_in_is_found_all_the_same(spoil: Callable[[np.random.Generator], Floats]) -> None:
    """Lost frames leave no trace in white noise, and none is claimed."""
    steps, repeats = SPOILT[spoil]
    for report in reports(spoil):
        assert report.stretch.breaks.all == list(steps)
        assert repeats is None or report.stretch.repeats == repeats
        assert report.frames == len(report.stretch.index)
        assert report.temporal.memory is None
    held([report.terms.tvh for report in reports(spoil)], SIGMA, widest=0.014)
    held([report.temporal.pair for report in reports(spoil)], SIGMA, widest=0.016)
    held([report.terms.vh for report in reports(spoil)], PIXEL, widest=0.084)


@lru_cache
def remembering(kind: str) -> tuple[NoiseReport, ...]:
    """AR(1) noise in a recording that stands still for 15 frames, has frames twice, or shows each of them thrice."""
    found = []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        frames: Floats = noise(rng, 120, RHO) + patterns(rng, 120)
        if kind == "shut":
            frames = frozen(frames, 50, 15)
        elif kind == "doubled":
            frames = np.repeat(frames, np.where(rng.random(120) < 0.3, 2, 1), axis=0)
        else:
            frames = np.repeat(frames, 3 + (np.arange(120) % 3 == 0), axis=0)
        found.append(measure_noise(frames, 30.0, WHOLE))
    return tuple(found)


@pytest.mark.parametrize(
    ("kind", "rate_hz"),
    [("shut", 30), *(pytest.param(*each, marks=pytest.mark.slow) for each in [("doubled", 30), ("slow", 9)])],
)
def test_memory_is_counted_in_frames_of_the_camera(kind: str, rate_hz: float) -> None:
    memories = []
    for report in remembering(kind):
        assert report.stretch.breaks.all == []
        assert report.stretch.rate_hz == pytest.approx(rate_hz, rel=0.01)
        assert report.temporal.memory is not None
        memories.append(report.temporal.memory)
    held([memory.rho for memory in memories], RHO, widest=0.019)
    held([memory.time_constant_s for memory in memories], -1 / (rate_hz * np.log(RHO)), widest=0.12)
    held([memory.total for memory in memories], SIGMA, widest=0.05)
    held([memory.fixed for memory in memories], PIXEL, widest=0.13)


def test_frames_that_are_alike_by_chance_or_always_are_no_repeats() -> None:
    rare = np.zeros((40, 64, 64))
    rare[np.arange(0, 40, 2), 5, 5] = 1
    assert len(new_frames(rare, 30.0).index) == 40
    assert len(new_frames(np.zeros((40, 64, 64)), 30.0).index) == 40
    rng = np.random.default_rng(0)
    new = new_frames(np.repeat(rng.normal(0, 1, (6, 8, 8)), [1, 2, 1, 4, 1, 1], axis=0), 30.0)
    assert new.index.tolist() == [0, 1, 3, 4, 8, 9]
    assert new.number.tolist() == [0, 1, 2, 3, 7, 8]


def test_too_few_new_frames_are_refused() -> None:
    frames = np.repeat(np.random.default_rng(0).normal(1000, SIGMA, (3, SIDE, SIDE)), 7, axis=0)
    with pytest.raises(InputError, match=r"^3 of 21 frames are new, .* too few to measure noise; allowed: at least 4$"):
        measure_noise(frames, 60.0)


def test_steps_are_looked_for_in_each_stretch() -> None:
    """The longest one between jumps holds a step; so does the one that is the longest once that is cut."""
    rng = np.random.default_rng(0)
    frames = noise(rng, 112) + patterns(rng, 112, 25, 52, 82)
    frames[50:52] += 500
    report = measure_noise(frames, 30.0, WHOLE)
    assert report.stretch.breaks == Breaks(jumps=(50, 52), steps=(25, 82))
    assert (report.stretch.index[0], len(report.stretch.index)) == (52, 30)
    assert report.terms.vh.low <= PIXEL <= report.terms.vh.high
    assert report.terms.tvh.low <= SIGMA <= report.terms.tvh.high


def texture(seed: int, side: int = 160) -> Floats:
    drawn = np.random.default_rng(seed).normal(0, 1, (side, side))
    blurred = cv2.GaussianBlur(drawn, (0, 0), 0.7)
    return np.asarray(blurred / blurred.std())


def white(rng: np.random.Generator) -> Floats:
    return noise(rng, 80)


def with_memory(rng: np.random.Generator) -> Floats:
    return noise(rng, 80, 0.97) + 0.3 * noise(rng, 80)


def losing_frames(rng: np.random.Generator) -> Floats:
    """Of noise with memory as an uncooled camera has it, white in part."""
    return (0.6 * noise(rng, 100) + 0.8 * noise(rng, 100, 0.9))[rng.random(100) > 0.05]


def drifting(rng: np.random.Generator) -> Floats:
    """Each pixel at a pace of its own, which is drawn anew every 20 frames: up to 4 SIGMA over all."""
    paces = rng.normal(0, 0.1 * SIGMA, (4, SIDE, SIDE))
    return np.cumsum(np.repeat(paces, 20, axis=0), axis=0) + noise(rng, 80)


def blurred(rng: np.random.Generator) -> Floats:
    return np.stack([cv2.GaussianBlur(frame, (0, 0), 1.0) for frame in noise(rng, 80)])


def whole_counts(rng: np.random.Generator) -> Floats:
    return np.rint(100 + 0.03 * noise(rng, 80) + rng.uniform(0, 1, (SIDE, SIDE)))


def blinking(rng: np.random.Generator) -> Floats:
    frames = noise(rng, 80)
    for row, column in rng.integers(SIDE, size=(8, 2)):
        frames[rng.integers(80) :, row, column] += rng.normal(0, 30 * SIGMA)
    return frames


def odd_frames(rng: np.random.Generator) -> Floats:
    """Some much noisier than the others."""
    return noise(rng, 80) * np.where(rng.random(80) < 0.1, 3, 1)[:, None, None]


def shaken(rng: np.random.Generator) -> Floats:
    """A camera that jumps by up to some px, once in a while: sharp texture as strong as the noise."""
    scene, frames = SIGMA * texture(int(rng.integers(1000))), noise(rng, 80)
    row = column = 50
    for frame in frames:
        if rng.random() < 0.1:
            row, column = rng.integers(46, 54, 2)
        frame += scene[row : row + SIDE, column : column + SIDE]
    return frames


def panned(rng: np.random.Generator) -> Floats:
    """A camera that turns at an uneven pace, and stops."""
    scene, frames = 3 * SIGMA * texture(int(rng.integers(1000))), noise(rng, 80)
    columns = np.cumsum(np.where(np.arange(80) < 50, rng.uniform(0, 2, 80), 0))
    for frame, column in zip(frames, columns, strict=True):
        shift = np.array([[1, 0, -column], [0, 1, -20]])
        frame += np.asarray(cv2.warpAffine(scene, shift, (SIDE, SIDE)), np.float64)
    return frames


def crossed(rng: np.random.Generator) -> Floats:
    frames = noise(rng, 80)
    for k in range(30, 60):
        frames[k, 10:30, max(3 * (k - 40), 0) : max(3 * (k - 30), 0)] += 20 * SIGMA
    return frames


@pytest.mark.sampled
@pytest.mark.parametrize("seeds", [range(15), pytest.param(range(15, 60), marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "draw",
    [
        *(white, with_memory, losing_frames, drifting, blurred, whole_counts, blinking),
        *(odd_frames, shaken, panned, crossed),
    ],
)
def test_nothing_else_is_taken_for_a_step(draw: Callable[[np.random.Generator], Floats], seeds: range) -> None:
    for seed in seeds:
        frames = draw(np.random.default_rng(seed))
        assert pattern_steps(frames, np.arange(len(frames))) == [], seed


@real
@pytest.mark.parametrize("name", ["raw14_lwir", "raw14_mwir", "raw16_lepton"])
def test_real_sensors_keep_their_pattern(name: str) -> None:
    with np.load(REAL / name / "frames.npz") as file:
        report = measure_noise(file["frames"], 30.0)
    assert (report.stretch.repeats, report.stretch.breaks.all) == (0, [])


@pytest.mark.sampled
@real
@pytest.mark.parametrize("name", ["birds_crossing", "drone_treeline", "sky_airplane_cirrus"])
def test_real_scenes_that_move_are_no_steps(name: str) -> None:
    film = cv2.VideoCapture(str(REAL / name / "frames.mp4"))
    frames = np.stack([film.read()[1][..., 0] for _ in range(180)])
    assert measure_noise(frames, 30.0).stretch.breaks.all == []


@pytest.mark.sampled
@pytest.mark.parametrize(("start", "width"), [(60, 1), (40, 8), (60, 32)])
def test_a_step_is_seen_from_the_stated_size_on(start: int, width: int) -> None:
    """P = (exp(6 sqrt(4 / n)) - 1) 2 tvh^2 / m is seen in the mean; four standard errors more, always."""
    chance = 2 / SIDE
    least = np.sqrt((np.exp(6 * chance) - 1) / width)  # of a pattern drawn anew, 2 s^2 = P
    count = start + 2 * width
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        pattern = patterns(rng, count, start) / PIXEL * SIGMA
        strong, weak = (noise(rng, count) + size * pattern for size in (1.35 * least, 0.3 * least))
        (found,) = pattern_steps(strong, np.arange(count))
        assert abs(found - start) <= width // 2
        assert pattern_steps(weak, np.arange(count)) == []


SCENE = """\
frames: 80
camera:
  size: [96, 80]
  netd_mk: 100
  noise: [{kind: white}, {kind: fixed_pattern, pixel: 1, column: 0, row: 0, redrawn: true}]
  correction: {frames: [34], freeze_frames: 15}
background: {kind: ground, spread_k: 0}
"""


def test_the_commands_say_what_was_left_out(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    told = "the fixed pattern changes at frame 49: figures are those of frames 4 to 33"
    repeated = "15 of 60 frames repeat the one before bit for bit: they do not count"
    lines = CliRunner().invoke(app, ["noise", str(scene), "--frames", "4:64"]).stdout
    assert told in lines
    assert repeated in lines
    found = json.loads(CliRunner().invoke(app, ["noise", str(scene), "--json"]).stdout)
    assert (found["stretch"]["repeats"], found["stretch"]["steps"]) == (15, [49])
    fitted = CliRunner().invoke(app, ["fit", str(scene), "--frames", "4:64", "--json"])
    notes = json.loads(fitted.stdout)["notes"]
    assert any(note.startswith(told) for note in notes)
    assert repeated in notes


@pytest.mark.parametrize("command", ["noise", "fit"])
def test_frames_in_errors_are_those_of_the_recording(command: str, tmp_path: Path) -> None:
    levels = [8000 if k == 13 else 1000 for k in range(18)]
    noise = np.random.default_rng(0).normal(0, 5, (18, SIDE, SIDE))
    shown = [np.rint(level + frame).astype(np.uint16) for level, frame in zip(levels, noise, strict=True)]
    import_frames(folder_of(tmp_path / "shown", shown), tmp_path / "shown.mcap")
    done = CliRunner().invoke(app, [command, str(tmp_path / "shown.mcap"), "--frames", "11:17"])
    assert isinstance(done.exception, InputError)
    assert "the picture becomes another at frames 13, 14: the longest stretch" in str(done.exception)


def test_nothing_is_said_where_nothing_is_left_out() -> None:
    report = measure_noise(lossy(np.random.default_rng(0)), 30.0, WHOLE)
    assert not [text for label, text in noise_lines(report) if label == "left out"]

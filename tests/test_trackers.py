"""One contract for every registered tracker, and the equations of each."""

from __future__ import annotations

import pickle
import sys
from math import exp, sqrt
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.trackers import TRACKERS, describe, make
from irtrack.trackers.base import Sight
from irtrack.trackers.grey_pf import GreyPF, weigh
from irtrack.trackers.kalman import Kalman
from irtrack.types import Estimate, Status, Tracker

# Every tracker of the table as it comes, and the named variants of those that have some.
VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in TRACKERS),
    ("grey_pf", {"noise": "fixed", "r0": 2.0, "resampling": "systematic", "update": False}),
    ("grey_pf", {"damping": 0.9, "bins": 16, "resampling": "residual", "w_t": 0.9}),
    ("template", {"window": 12, "update": 0.05}),
    ("kalman", {"measurement": "ncc"}),
]
EVERY = pytest.mark.parametrize(("name", "parameters"), VARIANTS)

Scene = list[tuple[Frame, tuple[float, float]]]


def blob(seed: int, *, count: int = 40, bits: int = 8, speed: float = 1.5, hidden: range = range(0)) -> Scene:
    """A Gaussian blob of 14 x 10 px on noise (SNR 13), and its true centre, px; hidden in some frames."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi)
    step = speed * np.array([np.cos(angle), np.sin(angle)])
    y, x = np.mgrid[:120, :160]
    scene = []
    for k in range(count):
        cx, cy = np.array([80.0, 60.0]) + (k - count / 2) * step
        target = 80 * np.exp(-((x - cx) ** 2) / (2 * 3.5**2) - (y - cy) ** 2 / (2 * 2.5**2))
        picture = 80 + (0 if k in hidden else 1) * target + 6 * rng.standard_normal(x.shape)
        image = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
        counts = image if bits == 8 else (3000 + 20 * image.astype(np.uint16)).astype(np.uint16)
        counts.setflags(write=False)
        scene.append((Frame(counts, k, k / 30, bits), (float(cx), float(cy))))
    return scene


def follow(tracker: Tracker, frames: list[Frame], box: Box, seed: int = 0) -> list[Estimate]:
    state = tracker.init(frames[0], box, stream(seed, "test", 0))
    estimates = []
    for k, frame in enumerate(frames[1:], 1):
        state, estimate = tracker.step(state, frame, stream(seed, "test", k))
        estimates.append(estimate)
    return estimates


def numbers(estimate: Estimate) -> list[Any]:
    """An estimate as plain values that compare exactly."""
    fields = (getattr(estimate, name) for name in Estimate.__slots__)
    return [field.tolist() if isinstance(field, np.ndarray) else field for field in fields]


def assert_legal(estimate: Estimate) -> None:
    assert estimate.status in get_args(Status)
    for name in ("center", "size", "score", "velocity", "covariance", "neff", "particles", "weights"):
        value = getattr(estimate, name)
        assert value is None or np.isfinite(value).all(), name
    if estimate.covariance is not None:
        assert estimate.covariance.shape == (2, 2)
        assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-9
    if estimate.weights is not None:
        assert estimate.weights.sum() == pytest.approx(1)
        assert estimate.neff is not None
        assert 1 - 1e-9 <= estimate.neff <= len(estimate.weights) + 1e-9


@EVERY
@pytest.mark.parametrize("bits", [8, 14])
def test_follows_an_easy_target(name: str, parameters: dict[str, Any], bits: int) -> None:
    for seed in range(4):
        scene = blob(seed, bits=bits)
        estimates = follow(make(name, parameters), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10), seed)
        errors = [np.hypot(*np.subtract(e.center, at)) for e, (_, at) in zip(estimates, scene[1:], strict=True)]
        assert np.mean(errors) < 1.5
        assert all(estimate.size == (14, 10) for estimate in estimates)
        assert np.mean([estimate.status == "tracking" for estimate in estimates]) > 0.9
        for estimate in estimates:
            assert_legal(estimate)


@EVERY
def test_is_deterministic_and_changes_nothing_that_it_is_given(name: str, parameters: dict[str, Any]) -> None:
    scene = blob(5, count=12)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    before = [frame.image.copy() for frame in frames]
    first = follow(make(name, parameters), frames, box)
    assert [numbers(e) for e in first] == [numbers(e) for e in follow(make(name, parameters), frames, box)]
    assert all(np.array_equal(a, frame.image) for a, frame in zip(before, frames, strict=True))


@EVERY
def test_a_pickled_state_resumes_bit_for_bit(name: str, parameters: dict[str, Any]) -> None:
    scene = blob(6, count=14, hidden=range(5, 8))
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    tracker = make(name, parameters)
    if not tracker.resumable:
        pytest.skip("says that it cannot be resumed")
    whole = [numbers(estimate) for estimate in follow(tracker, frames, box)]
    state = tracker.init(frames[0], box, stream(0, "test", 0))
    for k in range(1, 14):
        kept = pickle.dumps(state)
        state, estimate = pickle.loads(pickle.dumps(tracker)).step(pickle.loads(kept), frames[k], stream(0, "test", k))
        assert numbers(estimate) == whole[k - 1]
    # A step leaves the state that it starts from as it was.
    state = tracker.init(frames[0], box, stream(0, "test", 0))
    for _ in range(2):
        _, estimate = tracker.step(state, frames[1], stream(0, "test", 1))
        assert numbers(estimate) == whole[0]


@EVERY
def test_a_shifted_picture_gives_a_shifted_track(name: str, parameters: dict[str, Any]) -> None:
    """Two crops of the same pictures, 7 columns and 5 rows apart. The grey range is set to the full
    one, since the crops' percentiles differ."""
    full = {"bins_range": "full"} if "bins_range" in TRACKERS[name].model_fields else {}
    tracker = make(name, {**parameters, **full})
    scene = blob(8, count=15)
    (cx, cy) = scene[0][1]

    def crop(x: int, y: int) -> list[Estimate]:
        frames = [Frame(f.image[y : y + 110, x : x + 150], f.index, f.time, f.bits) for f, _ in scene]
        return follow(tracker, frames, Box(cx - x, cy - y, 14, 10))

    for here, there in zip(crop(0, 0), crop(7, 5), strict=True):
        assert here.center == pytest.approx((there.center[0] + 7, there.center[1] + 5), abs=1e-3)
        assert here.status == there.status


@EVERY
def test_says_so_while_the_target_is_hidden(name: str, parameters: dict[str, Any]) -> None:
    unseen = []
    for seed in range(4):
        scene = blob(20 + seed, count=30, hidden=range(20, 30))
        estimates = follow(make(name, parameters), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10), seed)
        unseen += [estimate.status != "tracking" for estimate in estimates[19:]]
    assert np.mean(unseen) >= 0.75


@EVERY
def test_a_target_that_leaves_is_not_tracked_for_ever(name: str, parameters: dict[str, Any]) -> None:
    scene = blob(3, count=20)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    empty = np.random.default_rng(1)
    for k in range(20, 50):
        image = np.clip(80 + 6 * empty.standard_normal((120, 160)), 0, 255).astype(np.uint8)
        frames.append(Frame(image, k, k / 30, 8))
    last = follow(make(name, parameters), frames, box)[-15:]
    for estimate in last:
        assert_legal(estimate)
    assert np.mean([estimate.status != "tracking" for estimate in last]) >= 0.6


@st.composite
def clips(draw: st.DrawFn) -> tuple[list[Frame], Box]:
    """Short clips of any kind of picture, and a start box that meets the frame."""
    rows, columns = draw(st.integers(8, 40)), draw(st.integers(8, 40))
    dtype, top = draw(st.sampled_from([(np.uint8, 255), (np.uint16, 65535)]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    frames = []
    for k in range(4):
        kind = draw(st.sampled_from(["noise", "constant", "saturated", "hot pixel", "halves"]))
        level = draw(st.sampled_from([0, 1, top // 2, top]))
        image = np.full((rows, columns), level, dtype)
        if kind == "noise":
            image = rng.integers(0, top, (rows, columns), dtype, endpoint=True)
        elif kind == "saturated":
            image = np.where(rng.random((rows, columns)) < 0.5, 0, top).astype(dtype)
        elif kind == "hot pixel":
            image[rng.integers(rows), rng.integers(columns)] = top
        elif kind == "halves":
            image[:, columns // 2 :] = top
        frames.append(Frame(image, k, k / 30, 8 * image.itemsize))
    w, h = draw(st.floats(1, 60)), draw(st.floats(1, 60))
    cx, cy = draw(st.floats(-w / 2 + 1, columns + w / 2 - 2)), draw(st.floats(-h / 2 + 1, rows + h / 2 - 2))
    return frames, Box(cx, cy, w, h)


@EVERY
@settings(max_examples=30, deadline=None, derandomize=True)
@given(clip=clips())
def test_any_picture_and_box_give_finite_estimates(
    name: str, parameters: dict[str, Any], clip: tuple[list[Frame], Box]
) -> None:
    for estimate in follow(make(name, parameters), *clip):
        assert_legal(estimate)


@EVERY
def test_a_constant_frame_shows_no_target(name: str, parameters: dict[str, Any]) -> None:
    frames = [Frame(np.full((60, 80), 90, np.uint8), k, k / 30, 8) for k in range(15)]
    estimates = follow(make(name, parameters), frames, Box(40, 30, 9, 7))
    assert estimates[-1].status == "lost"
    assert not any(estimate.status == "tracking" for estimate in estimates)


@EVERY
@pytest.mark.parametrize(
    ("image", "what"),
    [
        (np.zeros((50, 60), np.uint8), "60x50 uint8"),
        (np.zeros((60, 80), np.uint16), "80x60 uint16"),
        (np.zeros((60, 80, 3), np.uint8), "shape (60, 80, 3)"),
        (np.zeros((60, 80), np.float32), "float32"),
    ],
)
def test_frames_that_change_are_one_clear_error(name: str, parameters: dict[str, Any], image: Any, what: str) -> None:
    tracker = make(name, parameters)
    state = tracker.init(Frame(np.zeros((60, 80), np.uint8), 0, 0.0, 8), Box(40, 30, 9, 7), stream(0, 0))
    with pytest.raises(InputError) as caught:
        tracker.step(state, Frame(image, 7, 0.1, 8), stream(0, 1))
    assert "frame 7" in str(caught.value)
    assert what in str(caught.value)
    assert "\n" not in str(caught.value)


@EVERY
@pytest.mark.parametrize(
    "box", [Box(200, 30, 9, 7), Box(-10, 30, 9, 7), Box(40, 30, 0, 7), Box(float("nan"), 30, 9, 7)]
)
def test_impossible_start_boxes_are_one_clear_error(name: str, parameters: dict[str, Any], box: Box) -> None:
    frame = Frame(np.zeros((60, 80), np.uint8), 0, 0.0, 8)
    with pytest.raises(InputError, match=r"start box .*allowed"):
        make(name, parameters).init(frame, box, stream(0, 0))


@pytest.mark.parametrize("name", TRACKERS)
def test_parameters_go_out_and_in_again(name: str) -> None:
    cls = TRACKERS[name]
    defaults = cls().model_dump()
    assert repr(make(name, defaults)) == repr(cls())
    assert all(cls.model_fields[key].description for key in defaults)


def test_describe_has_a_row_for_every_tracker() -> None:
    rows = {row.name: row for row in describe()}
    assert set(TRACKERS) <= set(rows)
    for name in TRACKERS:
        assert rows[name].summary.endswith(".")
        assert rows[name].source


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("gray_pf", {}, ["unknown tracker 'gray_pf'", "grey_pf, template, kalman", "did you mean 'grey_pf'?"]),
        ("grey_pf", {"particle": 9}, ["grey_pf.particle: unknown parameter", "did you mean 'particles'?"]),
        ("grey_pf", {"particles": "many"}, ["grey_pf.particles", "integer", "'many'"]),
        ("grey_pf", {"particles": 1}, ["grey_pf.particles", "greater than or equal to 2", "not 1"]),
        ("grey_pf", {"alpha": 2.0}, ["grey_pf.alpha", "less than or equal to 1"]),
        ("grey_pf", {"alpha": float("nan")}, ["grey_pf.alpha", "finite"]),
        ("grey_pf", {"noise": "loud"}, ["grey_pf.noise", "'adaptive' or 'fixed'"]),
        ("grey_pf", {"r_min": 4.0, "r_max": 3.0}, ["grey_pf: r_max 3.0 is below r_min 4.0"]),
        ("kalman", {"measurement": True}, ["kalman.measurement", "'centroid' or 'ncc'"]),
        ("no_such_module:Tracker", {}, ["cannot import", "no_such_module"]),
        ("irtrack.types:Nothing", {}, ["cannot import", "Nothing"]),
        ("irtrack.types:Status", {}, ["not a tracker"]),
        ("irsim.types:Box", {}, ["not a tracker", "init, step, resumable"]),
        (":", {}, ["cannot import"]),
    ],
)
def test_bad_names_and_parameters_are_one_clear_line(name: str, parameters: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        make(name, parameters)
    text = str(caught.value)
    assert "\n" not in text
    for word in words:
        assert word in text


def test_each_wrong_parameter_has_a_line() -> None:
    with pytest.raises(InputError) as caught:
        make("kalman", {"gate": -1.0, "speed": 2})
    assert len(str(caught.value).splitlines()) == 2


FOREIGN = """
class Still:
    '''Stays where it began.'''
    resumable = True

    def __init__(self, offset=0.0):
        if offset < 0:
            raise ValueError("offset must not be negative")
        self.offset = offset

    def init(self, frame, box, rng):
        return box

    def step(self, state, frame, rng):
        return state, state.cx + self.offset
"""


@pytest.fixture
def foreign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a tracker of one's own, which is the current one."""
    (tmp_path / "my_foreign_tracker.py").write_text(FOREIGN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "my_foreign_tracker", raising=False)
    return tmp_path


def test_a_tracker_of_the_current_folder(foreign: Path) -> None:
    tracker = make("my_foreign_tracker:Still", {"offset": 2.0})
    state = tracker.init(Frame(np.zeros((9, 9), np.uint8), 0, 0.0, 8), Box(4, 4, 5, 5), stream(0))
    assert cast(Any, tracker).step(state, Frame(np.zeros((9, 9), np.uint8), 1, 0.1, 8), stream(0))[1] == 6
    with pytest.raises(InputError, match=r"unexpected keyword argument 'shift'"):
        make("my_foreign_tracker:Still", {"shift": 2.0})
    with pytest.raises(InputError, match=r"my_foreign_tracker:Still: offset must not be negative"):
        make("my_foreign_tracker:Still", {"offset": -2.0})


def test_a_module_that_fails_while_imported_is_one_line(foreign: Path) -> None:
    (foreign / "my_broken_tracker.py").write_text("class Still(:\n")
    with pytest.raises(InputError, match=r"cannot import tracker 'my_broken_tracker:Still': SyntaxError") as caught:
        make("my_broken_tracker:Still")
    assert "\n" not in str(caught.value)


def test_trackers_of_installed_packages(foreign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = foreign / "my_foreign_tracker-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-foreign-tracker\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[irtrack.trackers]\nstill = my_foreign_tracker:Still\ngone = no_such_module:Gone\nkalman = x:Y\n"
    )
    monkeypatch.syspath_prepend(foreign)
    assert make("still").resumable
    assert isinstance(make("kalman"), Kalman)
    rows = {row.name: row.summary for row in describe()}
    assert rows["still"] == "Stays where it began."
    assert rows["gone"].startswith("cannot import tracker 'gone'")
    with pytest.raises(InputError, match=r"did you mean 'still'\?"):
        make("stil")


def test_adaptive_noise_is_clipped_on_both_sides() -> None:
    """Cheng et al. 2006, eq. 12, with R0 = 10: .01 -> .1 -> Rmin; .3 -> 3; .9 -> 9 -> Rmax."""
    distances = np.array([0.01, 0.3, 0.9])
    assert GreyPF(r_min=0.5, r_max=5.0).deviation(distances, (14, 10)) == pytest.approx([0.5, 3, 5])
    assert GreyPF().deviation(distances, (14, 10)) == pytest.approx([0.5, 3, sqrt(140) / 2])
    assert GreyPF(noise="fixed", r0=2.0).deviation(distances, (14, 10)).tolist() == [2, 2, 2]


def test_weights_by_hand() -> None:
    """Cheng et al. 2006, eq. 10, lambda = 20: rho = .9, .7 give exp(-1), exp(-3)."""
    weights, in_view = weigh(np.array([0.9, 0.7, 0.0]), np.array([1.0, 0.5, 0.0]), 20.0)
    assert in_view
    assert weights == pytest.approx([exp(-1) / (exp(-1) + exp(-3)), exp(-3) / (exp(-1) + exp(-3)), 0])
    weights, _ = weigh(np.array([0.9, 0.7]), np.ones(2), 1e9)
    assert weights.tolist() == [1, 0]
    weights, in_view = weigh(np.zeros(4), np.zeros(4), 20.0)
    assert not in_view
    assert weights.tolist() == [0.25] * 4


def test_grey_pf_with_all_particles_outside_is_lost() -> None:
    scene = blob(0, count=2)
    tracker = GreyPF()
    state = tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0))
    fields = {name: getattr(state, name) for name in type(state).__slots__}
    away = {**fields, "positions": state.positions + 500, "previous": state.previous + 500}
    _, estimate = tracker.step(type(state)(**away), scene[1][0], stream(0, 1))
    assert estimate.status == "lost"
    assert estimate.neff == pytest.approx(100)


def test_grey_pf_updates_its_reference_by_eq_13_only_when_trusted() -> None:
    scene = blob(0, count=2)
    box = Box(*scene[0][1], 14, 10)

    def change(**parameters: Any) -> float:
        tracker = GreyPF(**parameters)
        state = tracker.init(scene[0][0], box, stream(0, 0))
        after, _ = tracker.step(state, scene[1][0], stream(0, 1))
        assert after.reference.sum() == pytest.approx(1)
        return float(np.abs(after.reference - state.reference).sum())

    assert change(update=False) == 0
    assert change(w_t=1.0) == 0
    assert change(w_t=0.0, alpha=0.1) == pytest.approx(5 * change(w_t=0.0, alpha=0.02))
    assert change(w_t=0.0) == change() > 0


def test_sight_by_hand() -> None:
    sight = Sight().after(0.8, 0.4, 0.5)
    assert (sight.level, sight.missed) == (0.8, 0)
    # The threshold is .4 + .5 (.8 - .4) = .6; seen, the level moves by a tenth of the way.
    assert sight.after(0.61, 0.4, 0.5).level == pytest.approx(0.8 - 0.019)
    hidden = sight.after(0.59, 0.4, 0.5).after(0.1, 0.4, 0.5)
    assert (hidden.level, hidden.missed) == (0.8, 2)
    assert [hidden.status(lost_after) for lost_after in (2, 3)] == ["lost", "occluded"]
    assert hidden.after(0.7, 0.4, 0.5).status(2) == "tracking"
    # What is no better than its surroundings is not seen, whatever it was before.
    assert sight.after(0.8, 0.9, 0.5).missed == 1
    assert Sight().after(1.0, 1.0, 0.5).missed == 1


def test_kalman_rejects_a_measurement_beyond_the_gate() -> None:
    """A second, equal blob appears 20 px away while the first is gone: the prediction stands."""
    scene = blob(2, count=30, speed=0.0)
    frames, (cx, cy) = [frame for frame, _ in scene], scene[0][1]
    for k in range(25, 30):
        image = np.roll(frames[k].image, 20, axis=1)
        frames[k] = Frame(image, k, k / 30, 8)
    estimates = follow(Kalman(), frames, Box(cx, cy, 14, 10))
    first = estimates[24]
    assert first.status == "occluded"
    assert np.hypot(*np.subtract(first.center, (cx, cy))) < 0.5
    assert first.covariance is not None
    assert estimates[23].covariance is not None
    assert np.trace(first.covariance) > np.trace(estimates[23].covariance)

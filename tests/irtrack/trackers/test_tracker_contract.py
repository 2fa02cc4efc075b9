"""One contract for every registered tracker."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracker_scenes import blob, follow

from irsim.config.schema import Slot
from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.features.highpass import HighPass
from irtrack.registry.table import TRACKERS, make
from irtrack.types import Estimate, Tracker, resumable
from irtrack.validity import fault

VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in TRACKERS),
    ("grey_pf", {"noise": "fixed", "r0": 2.0, "resampling": "systematic", "update": False, "damping": 0.9}),
    ("grey_pf", {"high_pass": "ring", "grid": 2, "adapt": "kld", "resampling": "residual", "w_t": 0.9}),
    ("grey_pf", {"high_pass": "full", "kernel": "epanechnikov", "adapt": "neff", "bins": 16}),
    ("grey_pf", {"groups": "two", "wide_sd": 3.0}),
    ("cascade_pf", {"velocity": "least_squares", "carried": True, "propagation": "disc", "radius": 5.0}),
    ("product_pf", {"velocity": "sqrt_lambda", "high_pass": "none", "update": "seen"}),
    ("product_pf", {"high_pass": "butterworth", "by_speed": True}),
    ("cascade_pf", {"by_speed": True, "by_speed_most": 2.0}),
    ("mean_shift", {"high_pass": "ring", "alpha": 0.1}),
    ("mean_shift_kalman", {"high_pass": "ring", "bandwidth": 1.3}),
    ("mean_shift_pf", {"corrected": True, "particles": 15, "high_pass": "ring", "propagation": "disc"}),
    ("background_restrained_pf", {"keep_by": "mass", "keep": 0.5}),
    ("background_restrained_pf", {"estimate": "map", "particles": 400, "r0": 5.0}),
    ("template", {"window": 12, "update": 0.05}),
    ("kalman", {"measurement": "ncc", "update": 0.05}),
    ("optical_flow", {"check": True}),
    ("ekf", {"measurement": "mean_shift"}),
    ("camshift_kalman", {"weights": "share", "resize": 0}),
    ("svd_pf", {"use": "svd", "components": 1}),
    ("svd_pf", {"use": "pf"}),
    ("change_kalman", {"company": False, "register_frames": False}),
    ("apf_tbd", {"auxiliary": False, "whiten": "none", "resampling": "residual"}),
    ("pdaf", {"detector": "matched_filter:psf=2:side=11", "amplitude": False, "direction": False, "clutter": 1e-4}),
    ("h_infinity", {"measurement": "ncc", "speed_weight": 1.0, "theta": 0.01}),
    ("lbp_mean_shift", {"offset": 0.0, "bins": 16, "alpha": 0.1}),
    ("hog_pf", {"detect": False, "sharpness": 1.0, "size_walk": 0.0, "resampling": "residual"}),
    ("adaboost_pf", {"step_by": "fixed", "feedback": False, "high_pass": "ring", "damping": 0.7}),
    ("upf", {"weigh": "match", "particles": 30, "resampling": "residual"}),
    ("upf", {"proposal": "prior", "high_pass": "ring"}),
    ("likelihood_pf", {"sampling": "two", "propagation": "disc"}),
    ("likelihood_pf", {"regressed": True, "resampling": "systematic"}),
    ("histogram_moments", {"cues": "moments", "reach": 4}),
    ("histogram_moments", {"cues": "histogram", "shift": False, "alpha": 0.1, "high_pass": "ring"}),
    ("ensemble", {"renewed": 0}),
    ("ensemble", {"classifiers": 3, "renewed": 3, "ring": 1.0}),
    ("imm_mf", {"hypotheses": 1, "register_frames": False, "weight": 0.5}),
    ("fusion_wspf", {"rho_t": None, "restoring": "equal", "confidence": "variance_ratio", "accept": 0.9}),
]
SIZE_TOLERANCE = {"fusion_wspf": 0.3, "camshift_kalman": 0.3, "hog_pf": 0.3}
"""Of trackers that follow the size; all others keep that of the start box."""
SHIFT_TOLERANCE = {
    "svd_pf": 1.0,
    "apf_tbd": 0.5,
    "pdaf": 0.5,
    "optical_flow": 0.05,
    "change_kalman": 0.05,
    "imm_mf": 0.05,
}
"""px. Of trackers on the whole frame: crops have other singular values, noise levels, pyramids and
registrations."""
EVERY = pytest.mark.parametrize(("name", "parameters"), VARIANTS)
SMALL, START = Frame(np.zeros((60, 80), np.uint8), 0, 0.0, 8), Box(40, 30, 9, 7)


def numbers(estimate: Estimate) -> list[Any]:
    """An estimate as plain values that compare exactly."""
    fields = (getattr(estimate, name) for name in Estimate.__slots__)
    return [field.tolist() if isinstance(field, np.ndarray) else field for field in fields]


def assert_valid(estimate: Estimate) -> None:
    assert fault(estimate) is None
    if estimate.covariance is not None:
        assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-9
    if estimate.weights is not None:
        assert estimate.neff is not None
        assert 1 - 1e-9 <= estimate.neff <= len(estimate.weights) + 1e-9


@EVERY
def test_follows_an_easy_target_by_pure_steps(name: str, parameters: dict[str, Any]) -> None:
    """A pickled tracker and state resume bit for bit; frames and states stay unchanged. On 8 and 14 bits."""
    for bits in (8, 14):
        scene = blob(bits // 7, count=24, bits=bits)
        frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
        before = [frame.image.copy() for frame in frames]
        tracker = make(name, parameters)
        assert resumable(tracker)
        estimates = follow(tracker, frames, box)
        errors = [np.hypot(*np.subtract(e.center, at)) for e, (_, at) in zip(estimates, scene[1:], strict=True)]
        assert np.mean(errors) < 1.5
        assert np.allclose([estimate.size for estimate in estimates], (14, 10), rtol=SIZE_TOLERANCE.get(name, 0))
        assert np.mean([estimate.status == "tracking" for estimate in estimates]) > 0.9
        for estimate in estimates:
            assert_valid(estimate)
        state = tracker.init(frames[0], box, stream(0, "test", 0))
        for k in range(1, 8):
            kept = pickle.dumps(state)
            assert numbers(tracker.step(state, frames[k], stream(0, "test", k))[1]) == numbers(estimates[k - 1])
            again: Tracker = pickle.loads(pickle.dumps(tracker))
            state, estimate = again.step(pickle.loads(kept), frames[k], stream(0, "test", k))
            assert numbers(estimate) == numbers(estimates[k - 1])
        assert all(np.array_equal(a, frame.image) for a, frame in zip(before, frames, strict=True))


NEEDED: dict[str, dict[str, Any]] = {
    "r_max": {"r_min": 0},
    "ring_": {"high_pass": "ring"},
    "grid": {"high_pass": "ring"},
    "n_min": {"adapt": "neff"},
    "neff_": {"adapt": "neff"},
    "kld_": {"adapt": "kld"},
    "jitter": {"corrected": True},
    "wide_": {"groups": "two"},
    "coarse": {"sampling": "two"},
    "scatter": {"regressed": True},
    "by_speed_most": {"by_speed": True},
    "place_sd": {"velocity": "least_squares"},
}
"""Switches that make the parameters with these first letters matter."""


def limits_of(kind: type[Any]) -> list[tuple[str, float]]:
    """The least and largest values of each parameter."""
    return [
        (key, limit)
        for key, field in kind.model_fields.items()
        for item in Slot.of(field.annotation, field.metadata).metadata
        for limit in [getattr(item, "ge", getattr(item, "le", None))]
        if limit is not None and limit < 100_000  # a million particles would only be slow
    ]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", TRACKERS)
def test_each_parameter_at_its_limits(name: str) -> None:
    scene = blob(3, count=6, hidden=range(3, 4))
    frames, fields = [frame for frame, _ in scene], TRACKERS[name].model_fields
    for key, limit in limits_of(TRACKERS[name]):
        needed = next((switches for word, switches in NEEDED.items() if key.startswith(word)), {})
        others = {k: v for k, v in needed.items() if k in fields and k != key}
        for measurement in ("centroid", "ncc", "mean_shift") if name in ("kalman", "ekf", "h_infinity") else (None,):
            chosen = {"measurement": measurement} if measurement else {}
            for estimate in follow(make(name, others | {key: limit} | chosen), frames, Box(*scene[0][1], 14, 10)):
                assert_valid(estimate)


@pytest.mark.parametrize("name", TRACKERS)
def test_a_shifted_picture_gives_a_shifted_track(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two crops of the same pictures, 7 columns and 5 rows apart. The grey range is set to the full
    one, since the crops' percentiles differ, and so does the noise that scales a high-pass; a grid is
    fixed to the frame."""
    monkeypatch.setattr(HighPass, "fitted", lambda image, kernel, grid: HighPass(kernel, grid, 2.13))
    alike = {"bins_range": "full", "ring_l": 5, "ring_inner": 4, "grid": 1}
    fields = TRACKERS[name].model_fields
    tracker = make(name, {key: value for key, value in alike.items() if key in fields})
    scene = blob(8, count=10)
    (cx, cy) = scene[0][1]

    def crop(x: int, y: int) -> list[Estimate]:
        frames = [Frame(f.image[y : y + 110, x : x + 150], f.index, f.time, f.bits) for f, _ in scene]
        return follow(tracker, frames, Box(cx - x, cy - y, 14, 10))

    for here, there in zip(crop(0, 0), crop(7, 5), strict=True):
        tolerance = SHIFT_TOLERANCE.get(name, 1e-3)
        assert here.center == pytest.approx((there.center[0] + 7, there.center[1] + 5), abs=tolerance)
        assert here.status == there.status


@EVERY
def test_status_where_there_is_no_target(name: str, parameters: dict[str, Any]) -> None:
    """The target is hidden; it leaves for good; the frame is constant."""
    hidden = []
    for seed in range(2):
        scene = blob(20 + seed, count=30, hidden=range(20, 30))
        estimates = follow(make(name, parameters), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10), seed)
        hidden += [estimate.status != "tracking" for estimate in estimates[19:]]
    assert np.mean(hidden) >= 0.75
    scene = blob(3, count=50, hidden=range(20, 50))
    last = follow(make(name, parameters), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10))[-15:]
    for estimate in last:
        assert_valid(estimate)
    assert np.mean([estimate.status != "tracking" for estimate in last]) >= 0.6
    even = [Frame(np.full((60, 80), 90, np.uint8), k, k / 30, 8) for k in range(15)]
    estimates = follow(make(name, parameters), even, START)
    assert estimates[-1].status == "lost"
    assert not any(estimate.status == "tracking" for estimate in estimates)


@st.composite
def clips(draw: st.DrawFn) -> tuple[list[Frame], Box]:
    """Short clips of any kind of picture, and a start box that meets the frame."""
    rows, columns = draw(st.integers(8, 40)), draw(st.integers(8, 40))
    dtype, top = draw(st.sampled_from([(np.uint8, 255), (np.uint16, 65535)]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    level = draw(st.sampled_from([0, 1, top // 2, top]))
    pictures: dict[str, Callable[[], Any]] = {
        "noise": lambda: rng.integers(0, top, (rows, columns), dtype, endpoint=True),
        "constant": lambda: np.full((rows, columns), level, dtype),
        "saturated": lambda: np.where(rng.random((rows, columns)) < 0.5, 0, top).astype(dtype),
        "hot pixel": lambda: np.where(np.arange(rows * columns).reshape(rows, -1) == 77, top, level).astype(dtype),
        "halves": lambda: np.where(np.arange(columns) < columns // 2, level, np.full((rows, 1), top)).astype(dtype),
    }
    images = [pictures[draw(st.sampled_from(list(pictures)))]() for _ in range(4)]
    frames = [Frame(image, k, k / 30, 8 * image.itemsize) for k, image in enumerate(images)]
    w, h = draw(st.floats(1, 60)), draw(st.floats(1, 60))
    cx, cy = draw(st.floats(-w / 2 + 1, columns + w / 2 - 2)), draw(st.floats(-h / 2 + 1, rows + h / 2 - 2))
    return frames, Box(cx, cy, w, h)


@EVERY
@settings(max_examples=8, deadline=None, derandomize=True)
@given(clip=clips())
def test_any_picture_and_box_give_valid_estimates(
    name: str, parameters: dict[str, Any], clip: tuple[list[Frame], Box]
) -> None:
    for estimate in follow(make(name, parameters), *clip):
        assert_valid(estimate)


@pytest.mark.parametrize("name", TRACKERS)
def test_wrong_frames_and_start_boxes_are_one_error(name: str) -> None:
    tracker = make(name)
    for box in (Box(200, 30, 9, 7), Box(-10, 30, 9, 7), Box(40, 30, 0, 7), Box(float("nan"), 30, 9, 7)):
        with pytest.raises(InputError, match=r"start box .*allowed"):
            tracker.init(SMALL, box, stream(0, 0))
    state = tracker.init(SMALL, START, stream(0, 0))
    for image, what in (
        (np.zeros((50, 60), np.uint8), "60x50 uint8"),
        (np.zeros((60, 80), np.uint16), "80x60 uint16"),
        (np.zeros((60, 80), np.float32), "float32"),
    ):
        with pytest.raises(InputError, match=f"frame 7.*{what}") as caught:
            tracker.step(state, Frame(image, 7, 0.1, 8), stream(0, 1))  # type: ignore[arg-type]  # what is wrong is the test
        assert "\n" not in str(caught.value)

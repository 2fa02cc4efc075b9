"""One contract for every registered tracker."""

from __future__ import annotations

import pickle
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
from irtrack.types import Estimate, fault, resumable

VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in TRACKERS),
    ("grey_pf", {"noise": "fixed", "r0": 2.0, "resampling": "systematic", "update": False}),
    ("grey_pf", {"damping": 0.9, "bins": 16, "resampling": "residual", "w_t": 0.9}),
    ("grey_pf", {"high_pass": "ring", "grid": 2, "adapt": "kld"}),
    ("grey_pf", {"high_pass": "full", "kernel": "epanechnikov", "adapt": "neff"}),
    ("cascade_pf", {"velocity": "least_squares", "carried": True, "propagation": "disc", "radius": 5.0}),
    ("product_pf", {"velocity": "sqrt_lambda", "high_pass": "none", "update": "seen"}),
    ("mean_shift", {"high_pass": "ring", "alpha": 0.1}),
    ("mean_shift_kalman", {"high_pass": "ring", "bandwidth": 1.3}),
    ("mean_shift_pf", {"corrected": True, "particles": 15}),
    ("mean_shift_pf", {"high_pass": "ring", "propagation": "disc", "corrected": True, "particles": 15}),
    ("background_restrained_pf", {"keep_by": "mass", "keep": 0.5}),
    ("background_restrained_pf", {"estimate": "map", "particles": 400, "r0": 5.0}),
    ("template", {"window": 12, "update": 0.05}),
    ("kalman", {"measurement": "ncc"}),
    ("kalman", {"measurement": "mean_shift"}),
    ("ekf", {"measurement": "ncc"}),
    ("ekf", {"measurement": "mean_shift"}),
    ("camshift_kalman", {"weights": "share", "resize": 0}),
    ("svd_pf", {"use": "svd", "components": 1}),
    ("svd_pf", {"use": "pf"}),
    ("change_kalman", {"company": False, "register_frames": False}),
    ("fusion_wspf", {"rho_t": None, "restoring": "equal", "confidence": "variance_ratio", "accept": 0.9}),
]
SIZE_TOLERANCE = {"fusion_wspf": 0.3, "camshift_kalman": 0.3}
"""Of trackers that follow the size; all others keep that of the start box."""
SHIFT_TOLERANCE = {"svd_pf": 1.0, "optical_flow": 0.05, "change_kalman": 0.05}
"""px. Of trackers on the whole frame: crops have other singular values, pyramids and registrations."""
EVERY = pytest.mark.parametrize(("name", "parameters"), VARIANTS)


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
@pytest.mark.parametrize("bits", [8, 14])
def test_follows_an_easy_target(name: str, parameters: dict[str, Any], bits: int) -> None:
    scene = blob(bits // 7, bits=bits)
    estimates = follow(make(name, parameters), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10))
    errors = [np.hypot(*np.subtract(e.center, at)) for e, (_, at) in zip(estimates, scene[1:], strict=True)]
    assert np.mean(errors) < 1.5
    assert np.allclose([estimate.size for estimate in estimates], (14, 10), rtol=SIZE_TOLERANCE.get(name, 0))
    assert np.mean([estimate.status == "tracking" for estimate in estimates]) > 0.9
    for estimate in estimates:
        assert_valid(estimate)


NEEDED: dict[str, dict[str, Any]] = {
    "r_max": {"r_min": 0},
    "ring_": {"high_pass": "ring"},
    "grid": {"high_pass": "ring"},
    "n_min": {"adapt": "neff"},
    "neff_": {"adapt": "neff"},
    "kld_": {"adapt": "kld"},
    "jitter": {"corrected": True},
    "place_sd": {"velocity": "least_squares"},
}
"""Switches that make the parameters of these first letters matter."""

LIMITS = [
    (name, key, limit)
    for name, kind in TRACKERS.items()
    for key, field in kind.model_fields.items()
    for item in Slot.of(field.annotation, field.metadata).metadata
    for limit in [getattr(item, "ge", getattr(item, "le", None))]
    if limit is not None and limit < 100_000  # a million particles would only be slow
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("name", "key", "limit"), LIMITS)
def test_each_parameter_at_its_limits(name: str, key: str, limit: float) -> None:
    scene = blob(3, count=9, hidden=range(4, 6))
    others = next((switches for word, switches in NEEDED.items() if key.startswith(word)), {})
    others = {k: v for k, v in others.items() if k in TRACKERS[name].model_fields and k != key}
    for measurement in ("centroid", "ncc", "mean_shift") if name in ("kalman", "ekf") else (None,):
        tracker = make(name, others | {key: limit} | ({"measurement": measurement} if measurement else {}))
        for estimate in follow(tracker, [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)):
            assert_valid(estimate)


@EVERY
def test_steps_are_pure_and_a_copied_state_resumes(name: str, parameters: dict[str, Any]) -> None:
    """Repeated, from a pickled tracker and state, bit for bit; frames and states stay as they were."""
    scene = blob(6, count=12, hidden=range(5, 8))
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    before = [frame.image.copy() for frame in frames]
    tracker = make(name, parameters)
    assert resumable(tracker)
    whole = [numbers(estimate) for estimate in follow(tracker, frames, box)]
    state = tracker.init(frames[0], box, stream(0, "test", 0))
    for k in range(1, 12):
        kept = pickle.dumps(state)
        _, first = tracker.step(state, frames[k], stream(0, "test", k))
        assert numbers(first) == whole[k - 1]
        state, estimate = pickle.loads(pickle.dumps(tracker)).step(pickle.loads(kept), frames[k], stream(0, "test", k))
        assert numbers(estimate) == whole[k - 1]
    assert all(np.array_equal(a, frame.image) for a, frame in zip(before, frames, strict=True))


@EVERY
def test_a_shifted_picture_gives_a_shifted_track(
    name: str, parameters: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two crops of the same pictures, 7 columns and 5 rows apart. The grey range is set to the full
    one, since the crops' percentiles differ, and so does the noise that scales a high-pass; a grid is
    fixed to the frame."""
    monkeypatch.setattr(HighPass, "fitted", lambda image, kernel, grid: HighPass(kernel, grid, 2.13))
    alike = {"bins_range": "full", "ring_l": 5, "ring_inner": 4, "grid": 1}
    fields = TRACKERS[name].model_fields
    tracker = make(name, parameters | {key: value for key, value in alike.items() if key in fields})
    scene = blob(8, count=15)
    (cx, cy) = scene[0][1]

    def crop(x: int, y: int) -> list[Estimate]:
        frames = [Frame(f.image[y : y + 110, x : x + 150], f.index, f.time, f.bits) for f, _ in scene]
        return follow(tracker, frames, Box(cx - x, cy - y, 14, 10))

    for here, there in zip(crop(0, 0), crop(7, 5), strict=True):
        tolerance = SHIFT_TOLERANCE.get(name, 1e-3)
        assert here.center == pytest.approx((there.center[0] + 7, there.center[1] + 5), abs=tolerance)
        assert here.status == there.status


@EVERY
def test_status_while_the_target_is_hidden(name: str, parameters: dict[str, Any]) -> None:
    unseen = []
    for seed in range(3):
        scene = blob(20 + seed, count=30, hidden=range(20, 30))
        estimates = follow(make(name, parameters), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10), seed)
        unseen += [estimate.status != "tracking" for estimate in estimates[19:]]
    assert np.mean(unseen) >= 0.75


@EVERY
def test_status_after_the_target_left(name: str, parameters: dict[str, Any]) -> None:
    scene = blob(3, count=20)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    empty = np.random.default_rng(1)
    for k in range(20, 50):
        image = np.clip(80 + 6 * empty.standard_normal((120, 160)), 0, 255).astype(np.uint8)
        frames.append(Frame(image, k, k / 30, 8))
    last = follow(make(name, parameters), frames, box)[-15:]
    for estimate in last:
        assert_valid(estimate)
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
@settings(max_examples=12, deadline=None, derandomize=True)
@given(clip=clips())
def test_any_picture_and_box_give_valid_estimates(
    name: str, parameters: dict[str, Any], clip: tuple[list[Frame], Box]
) -> None:
    for estimate in follow(make(name, parameters), *clip):
        assert_valid(estimate)


@EVERY
def test_a_constant_frame_has_no_target(name: str, parameters: dict[str, Any]) -> None:
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
        (np.zeros((60, 80), np.float32), "float32"),
    ],
)
def test_frames_of_another_kind_are_one_error(name: str, parameters: dict[str, Any], image: Any, what: str) -> None:
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
def test_impossible_start_boxes_are_one_error(name: str, parameters: dict[str, Any], box: Box) -> None:
    frame = Frame(np.zeros((60, 80), np.uint8), 0, 0.0, 8)
    with pytest.raises(InputError, match=r"start box .*allowed"):
        make(name, parameters).init(frame, box, stream(0, 0))

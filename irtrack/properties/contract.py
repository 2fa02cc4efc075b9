"""Properties of the interface of trackers, so that runs can be repeated, resumed, and run in other processes."""

from __future__ import annotations

import os
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from irsim.errors import counted
from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.properties.case import Broken, Case, Clip, NotAsked, Walk, expect_same, numbers, walk
from irtrack.runner.worker import NotSentError, call_in_new_interpreter
from irtrack.types import resumable

KINDS = ("noise", "even", "saturated", "one hot pixel", "halves")


def valid_output(case: Case) -> None:
    """Estimates are finite and well formed for any picture and any start box."""
    rows, columns = case.draw("rows", st.integers(8, 48)), case.draw("columns", st.integers(8, 48))
    dtype = np.dtype(case.draw("dtype", st.sampled_from(["uint8", "uint16"])))
    kinds = case.draw("pictures", st.lists(st.sampled_from(KINDS), min_size=2, max_size=8))
    w, h = case.draw("width", st.floats(1, 60)), case.draw("height", st.floats(1, 60))
    cx = case.draw("cx", st.floats(1 - w / 2, columns + w / 2 - 2))
    cy = case.draw("cy", st.floats(1 - h / 2, rows + h / 2 - 2))
    rng = stream(case.draw("seed", st.integers(0, 2**31)), "pictures")
    images = np.stack([_picture(kind, (rows, columns), dtype, rng) for kind in kinds])
    images.setflags(write=False)
    count = len(kinds)
    no_center = np.full((count, 2), np.nan)
    bits = 8 * dtype.itemsize
    clip = Clip(images, np.arange(count) / 30, no_center, np.zeros(count), Box(cx, cy, w, h), "", bits)
    walk(case.tracker, clip)


def _picture(kind: str, shape: tuple[int, int], dtype: np.dtype[np.generic], rng: np.random.Generator) -> np.ndarray:
    top = int(np.iinfo(dtype).max)  # type: ignore[type-var]  # integers only
    image = np.full(shape, top // 3, dtype)
    if kind == "noise":
        image = rng.integers(0, top, shape, np.uint16, endpoint=True).astype(dtype)
    elif kind == "saturated":
        image = np.where(rng.random(shape) < 0.5, 0, top).astype(dtype)
    elif kind == "one hot pixel":
        image[int(rng.integers(shape[0])), int(rng.integers(shape[1]))] = top
    elif kind == "halves":
        image[:, shape[1] // 2 :] = top
    return image


def deterministic(case: Case) -> None:
    """The same frames and random generators give the same estimates."""
    clip = case.clip()
    expect_same(walk(case.tracker, clip), walk(case.tracker, clip), "run again")


def cross_process(case: Case) -> None:
    """Runs in another process, with another hash seed, give the same estimates."""
    clip = case.clip()
    if type(case.tracker).__module__ == "__main__":
        raise NotAsked("its class is defined in the main program, which other processes do not have")
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    try:
        answer: Walk = call_in_new_interpreter(walk, case.tracker, clip, PYTHONHASHSEED=seed)
    except NotSentError as error:
        raise NotAsked(f"it cannot be pickled: {error}") from None
    except RuntimeError as error:
        raise RuntimeError(f"in another process: {error}") from None
    expect_same(answer, walk(case.tracker, clip), "in another process")


def causal(case: Case) -> None:
    """The estimate of a frame does not depend on later frames."""
    clip = case.clip()
    cut = case.draw("cut", st.integers(2, len(clip) - 2))
    images = clip.images.copy()
    images[cut:] = images[cut:, ::-1]
    other = clip.with_images(lambda _: images)
    before = walk(case.tracker, clip).estimates[: cut - 1]
    expect_same(Walk(walk(case.tracker, other).estimates[: cut - 1]), Walk(before), f"with other frames from {cut} on")


def immutable_output(case: Case) -> None:
    """Later steps do not change earlier estimates."""
    clip = case.clip()
    state = case.tracker.init(clip.frame(0), clip.box, stream(0, "check", 0))
    estimates, copies = [], []
    for k in range(1, len(clip)):
        state, estimate = case.tracker.step(state, clip.frame(k), stream(0, "check", k))
        estimates.append(estimate)
        copies.append(numbers(estimate))
    for k, (estimate, copy) in enumerate(zip(estimates, copies, strict=True), 1):
        if numbers(estimate) != copy:
            raise Broken(f"the estimate of frame {k} was changed by a later step")


def pure(case: Case) -> None:
    """A step does not change its input state: repeated, it gives the same estimate."""
    _require_resumable(case)
    clip = case.clip()
    state = case.tracker.init(clip.frame(0), clip.box, stream(0, "check", 0))
    for k in range(1, len(clip)):
        tried = [case.tracker.step(state, clip.frame(k), stream(0, "check", k)) for _ in range(2)]
        if numbers(tried[0][1]) != numbers(tried[1][1]):
            raise Broken(f"frame {k}: a second step from the same state gives another estimate")
        state = tried[1][0]


def resumes(case: Case) -> None:
    """A run resumed from a pickled state is the same bit for bit."""
    _require_resumable(case)
    clip = case.clip()
    cut = case.draw("cut", st.integers(1, len(clip) - 2))
    state = case.tracker.init(clip.frame(0), clip.box, stream(0, "check", 0))
    estimates = []
    for k in range(1, len(clip)):
        if k == cut:
            state = pickle.loads(pickle.dumps(state))
        state, estimate = case.tracker.step(state, clip.frame(k), stream(0, "check", k))
        estimates.append(estimate)
    expect_same(Walk(tuple(estimates)), walk(case.tracker, clip), f"pickled before frame {cut}")


def alone(case: Case) -> None:
    """Two interleaved runs of one tracker do not affect each other."""
    clip = case.clip()
    other = replace(clip.with_images(lambda images: images[:, ::-1, ::-1]), box=_turned(clip))
    own = [walk(case.tracker, each) for each in (clip, other)]
    states = [case.tracker.init(each.frame(0), each.box, stream(0, "check", 0)) for each in (clip, other)]
    found: list[list[object]] = [[], []]
    for k in range(1, len(clip)):
        for run, each in enumerate((clip, other)):
            states[run], estimate = case.tracker.step(states[run], each.frame(k), stream(0, "check", k))
            found[run].append(estimate)
    for run in range(2):
        expect_same(Walk(tuple(found[run])), own[run], "beside another run")


def _turned(clip: Clip) -> Box:
    columns, rows = clip.size
    return Box(columns - 1 - clip.box.cx, rows - 1 - clip.box.cy, clip.box.w, clip.box.h)


def readonly_input(case: Case) -> None:
    """Frames are read and not changed."""
    clip = case.clip()
    writable = replace(clip, images=clip.images.copy())
    walk(case.tracker, writable)
    changed = np.argwhere(writable.images != clip.images)
    if len(changed):
        k, row, column = changed[0]
        many = f"{counted(len(changed), 'pixel')} {'was' if len(changed) == 1 else 'were'}"
        raise Broken(f"{many} changed, the first at ({column}, {row}) of frame {k}")


def memory_layout(case: Case) -> None:
    """The memory layout of a picture has no effect: parts of larger arrays, columns first."""
    clip = case.clip()
    wide: Any = np.zeros((*clip.images.shape[:2], 2 * clip.images.shape[2]), clip.images.dtype)
    wide[:, :, ::2] = clip.images
    images: Any
    for how, images in (
        ("every other column", wide[:, :, ::2]),
        ("columns first", np.ascontiguousarray(clip.images.transpose(0, 2, 1)).transpose(0, 2, 1)),
    ):
        _expect_rounding(walk(case.tracker, replace(clip, images=images)), walk(case.tracker, clip), how)


def time_invariant(case: Case) -> None:
    """The same pictures an hour later, with other frame numbers, give the same estimates."""
    clip = case.clip()
    later = replace(clip, times=clip.times + 4096.0, first=100_000)  # a power of two, so that the sums are exact
    _expect_rounding(walk(case.tracker, later), walk(case.tracker, clip), "an hour later")


def _expect_rounding(one: Walk, other: Walk, how: str) -> None:
    """Raise Broken where centres differ by more than 0.001 px, the rounding of reordered sums and large times."""
    if len(one.centers) != len(other.centers):
        raise Broken(f"{how}: {len(one.centers)} and {len(other.centers)} rows; allowed: as many")
    off = np.hypot(*(one.centers - other.centers).T)
    if off.max(initial=0) > 1e-3:
        raise Broken(f"{how}: off by {off.max():.3g} px at frame {int(off.argmax()) + 1}; allowed: 0.001")


def bounded(case: Case) -> None:
    """The state does not grow with the number of frames."""
    clip = case.clip(speed=(0, 0))
    state = case.tracker.init(clip.frame(0), clip.box, stream(0, "check", 0))
    sizes = []
    for k in range(1, 181):
        frame = clip.frame(k % len(clip))
        state, _ = case.tracker.step(state, Frame(frame.image, k, k / 30, 8), stream(0, "check", k))
        if k in (60, 180):
            try:
                sizes.append(len(pickle.dumps(state)))
            except Exception as error:
                raise NotAsked("its state cannot be pickled") from error
    if sizes[1] > 1.5 * sizes[0] + 1000:
        raise Broken(f"pickled, the state has {sizes[0]} bytes after 60 frames and {sizes[1]} after 180")


def _require_resumable(case: Case) -> None:
    if not resumable(case.tracker):
        raise NotAsked("it does not declare resumable = True")

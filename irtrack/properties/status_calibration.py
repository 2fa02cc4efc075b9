"""Properties of status, score and covariance, and of the error under harder conditions, tested over many scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from irsim.types import Floats
from irtrack.properties.case import (
    BACKGROUND_GREY,
    SIGMAS,
    Broken,
    Case,
    Clip,
    NotAsked,
    Walk,
    expect_above,
    rendered,
    scene,
    walk,
)
from irtrack.properties.following import occluded

HIDDEN = (12, 24)
"""Long occlusion: index of its first frame, and index after its last frame."""
LATE = 4
"""Number of frames within which the status must change."""


def _scenes(case: Case, noise: int = 2, speed: int = 2) -> list[Clip]:
    """Return one scene for each seed, with all directions of motion."""
    clips = [rendered(scene(seed, noise, speed, seed % 8)) for seed in range(case.seeds)]
    case.clips = clips[:1]
    return clips


def _walks(case: Case, clips: list[Clip]) -> list[Walk]:
    return [walk(case.tracker, clip, seed) for seed, clip in enumerate(clips)]


def says_seen(case: Case) -> None:
    """The status is `tracking` in at least four of five frames with a visible target."""
    shares = np.array([each.tracking.mean() for each in _walks(case, _scenes(case))])
    expect_above(shares, 0.8, "share of frames with status tracking and a visible target")


def says_hidden(case: Case) -> None:
    """The status is not `tracking` in at least half of the occluded frames, from the fifth on."""
    first, stop = HIDDEN
    clips = [occluded(clip, first, stop) for clip in _scenes(case)]
    shares = np.array([1 - each.tracking[first + LATE - 1 : stop - 1].mean() for each in _walks(case, clips)])
    expect_above(shares, 0.5, "share of occluded frames without status tracking")


def says_gone(case: Case) -> None:
    """The status is not `tracking` in at least half of the frames, from 20 after the target has disappeared."""
    clips = []
    for clip in _scenes(case):
        gone = occluded(clip, 5, len(clip))
        empty = gone.select([*range(len(clip)), *range(10, len(clip))])
        clips.append(replace(empty, times=np.arange(len(empty)) / 30))
    shares = np.array([1 - each.tracking[25:].mean() for each in _walks(case, clips)])
    expect_above(shares, 0.5, "share of frames without status tracking after the disappearance")


def says_empty(case: Case) -> None:
    """The status is never `tracking` in frames of uniform grey."""
    (clip,) = _scenes(case)[:1]
    images = np.full_like(clip.images, BACKGROUND_GREY)
    images[0] = clip.images[0]
    claims = walk(case.tracker, clip.with_images(lambda _: images)).tracking[LATE:]
    if claims.any():
        raise Broken(f"status tracking in {claims.sum()} of {len(claims)} frames of uniform grey; allowed: none")


def score(case: Case) -> None:
    """The score is lower in occluded frames than in visible ones."""
    first, stop = HIDDEN
    differences = []
    for each in _walks(case, [occluded(clip, first, stop) for clip in _scenes(case)]):
        scores = [estimate.score for estimate in each.estimates]
        seen = [value for value in scores[: first - 1] if value is not None]
        unseen = [value for value in scores[first + 1 : stop - 1] if value is not None]
        if seen and unseen:
            differences.append(np.mean(seen) - np.mean(unseen))
    if not differences:
        raise NotAsked("it gives no score in these frames")
    expect_above(np.array(differences), 0.0, "score in visible frames minus that in occluded ones")


def nees(case: Case) -> None:
    """The covariance is not much too small: the normalised squared error (NEES) has mean 2, and at most 20.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 5.4.2.
    """
    means = []
    for clip, each in zip(clips := _scenes(case), _walks(case, clips), strict=True):
        values = [
            off @ np.linalg.pinv(np.asarray(estimate.covariance) + _ROUNDING) @ off
            for estimate, at in zip(each.estimates, clip.centers[1:], strict=True)
            if estimate.covariance is not None
            for off in [np.subtract(estimate.center, at)]
        ]
        means += [float(np.mean(values))] if values else []
    if not means:
        raise NotAsked("it gives no covariance")
    expect_above(-np.array(means), -20.0, "NEES, negative")


_ROUNDING: Floats = 1e-4 * np.eye(2)
"""Covariance of rounding, px², with a standard deviation of a hundredth of a pixel on each axis."""


def noise(case: Case) -> None:
    """More noise does not reduce the mean error."""
    _expect_no_better(
        _errors(case, _scenes(case, noise=1), 0), _errors(case, _scenes(case, noise=4), 0), "with more noise"
    )


def hiding(case: Case) -> None:
    """An occlusion does not reduce the mean error."""
    first, stop = HIDDEN
    clips = _scenes(case)
    seen = _errors(case, clips, stop)
    _expect_no_better(seen, _errors(case, [occluded(clip, first, stop) for clip in clips], stop), "after an occlusion")


def _errors(case: Case, clips: list[Clip], begin: int) -> Floats:
    """Return the mean distance from the target, px, from frame `begin` on, for each scene."""
    return np.array(
        [
            np.hypot(*(each.centers[begin:] - clip.centers[begin + 1 :]).T).mean()
            for clip, each in zip(clips, _walks(case, clips), strict=True)
        ]
    )


SLACK_PX = 0.25
"""Allowed reduction of the error, px: noise dithers grey levels and reduces rounding."""


def _expect_no_better(mild: Floats, hard: Floats, how: str) -> None:
    gain = mild - hard
    error = gain.std(ddof=1) / np.sqrt(len(gain))
    if gain.mean() - SIGMAS * error > SLACK_PX:
        raise Broken(f"{how} the error is {gain.mean():.2f} ± {error:.2f} px smaller; allowed: {SLACK_PX:g}")

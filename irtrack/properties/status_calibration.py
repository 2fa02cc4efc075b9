"""Properties of what a tracker says of itself, and of how it fails: over many scenes, with an interval."""

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
from irtrack.properties.following import hidden

HIDDEN = (12, 24)
"""Frames of the long hiding: first, and past the last."""
LATE = 4
"""Frames in which a tracker may take note that the target went."""


def _scenes(case: Case, noise: int = 2, speed: int = 2) -> list[Clip]:
    """As many scenes as there are seeds, in all directions; the tracker's seed is the scene's."""
    clips = [rendered(scene(seed, noise, speed, seed % 8)) for seed in range(case.seeds)]
    case.clips = clips[:1]
    return clips


def _walks(case: Case, clips: list[Clip]) -> list[Walk]:
    return [walk(case.tracker, clip, seed) for seed, clip in enumerate(clips)]


def says_seen(case: Case) -> None:
    """It says `tracking` while the target is plainly there: in four frames of five."""
    shares = np.array([each.tracking.mean() for each in _walks(case, _scenes(case))])
    expect_above(shares, 0.8, "share of frames called tracking while the target is there")


def says_hidden(case: Case) -> None:
    """It does not say `tracking` while the target is hidden: from the fifth frame on in half of them."""
    first, stop = HIDDEN
    clips = [hidden(clip, first, stop) for clip in _scenes(case)]
    shares = np.array([1 - each.tracking[first + LATE - 1 : stop - 1].mean() for each in _walks(case, clips)])
    expect_above(shares, 0.5, "share of hidden frames not called tracking")


def says_gone(case: Case) -> None:
    """A target that is gone for good is not tracked for ever: after 20 frames not in half of them."""
    clips = []
    for clip in _scenes(case):
        gone = hidden(clip, 5, len(clip))
        empty = gone.chosen([*range(len(clip)), *range(10, len(clip))])
        clips.append(replace(empty, times=np.arange(len(empty)) / 30))
    shares = np.array([1 - each.tracking[25:].mean() for each in _walks(case, clips)])
    expect_above(shares, 0.5, "share of frames not called tracking after the target went")


def says_empty(case: Case) -> None:
    """A picture of one grey shows no target."""
    (clip,) = _scenes(case)[:1]
    images = np.full_like(clip.images, BACKGROUND_GREY)
    images[0] = clip.images[0]
    said = walk(case.tracker, clip.pictured(lambda _: images)).tracking[LATE:]
    if said.any():
        raise Broken(f"tracking is said in {said.sum()} of {len(said)} frames of one grey; allowed: none")


def score(case: Case) -> None:
    """Its score is lower while the target is hidden than while it is seen."""
    first, stop = HIDDEN
    differences = []
    for each in _walks(case, [hidden(clip, first, stop) for clip in _scenes(case)]):
        scores = [estimate.score for estimate in each.estimates]
        seen = [value for value in scores[: first - 1] if value is not None]
        unseen = [value for value in scores[first + 1 : stop - 1] if value is not None]
        if seen and unseen:
            differences.append(np.mean(seen) - np.mean(unseen))
    if not differences:
        raise NotAsked("it gives no score there")
    expect_above(np.array(differences), 0.0, "score while seen less that while hidden")


def nees(case: Case) -> None:
    """Its covariance is not far too small: the mean squared error in its units (NEES) is 2, and 20 at most.

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
"""px^2: a hundredth of a pixel, which no one is held to."""


def noise(case: Case) -> None:
    """More noise makes it worse, or nothing: never better, over many scenes."""
    _expect_no_better(
        _errors(case, _scenes(case, noise=1), 0), _errors(case, _scenes(case, noise=4), 0), "with more noise"
    )


def hiding(case: Case) -> None:
    """A longer hiding makes it worse, or nothing: never better, over many scenes."""
    first, stop = HIDDEN
    clips = _scenes(case)
    seen = _errors(case, clips, stop)
    _expect_no_better(seen, _errors(case, [hidden(clip, first, stop) for clip in clips], stop), "after a hiding")


def _errors(case: Case, clips: list[Clip], begin: int) -> Floats:
    """Mean distance from the target of each scene from a frame on, px."""
    return np.array(
        [
            np.hypot(*(each.centers[begin:] - clip.centers[begin + 1 :]).T).mean()
            for clip, each in zip(clips, _walks(case, clips), strict=True)
        ]
    )


SLACK_PX = 0.25
"""What may be better by rounding: noise dithers grey levels, and a track may lie more luckily."""


def _expect_no_better(mild: Floats, hard: Floats, how: str) -> None:
    gain = mild - hard
    error = gain.std(ddof=1) / np.sqrt(len(gain))
    if gain.mean() - SIGMAS * error > SLACK_PX:
        raise Broken(f"{how} the error is {gain.mean():.2f} ± {error:.2f} px smaller; allowed: {SLACK_PX:g}")

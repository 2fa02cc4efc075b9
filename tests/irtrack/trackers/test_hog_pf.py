"""`hog_pf`: non-maximum suppression, detections that bring the track back, and the share of them."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_scenes import blob, follow

import irsim
from irsim.types import Box, Frame
from irtrack.registry.table import make
from irtrack.trackers.hog_pf import suppressed
from irtrack.training.frames import SCENARIOS, LabelledFrame, box_of, labelled_frames
from irtrack.training.scores import area_under_roc, detection_rate, roc_scores
from irtrack.training.windows import windows_of


def test_windows_that_overlap_a_better_one_are_left_out() -> None:
    boxes = np.array([[10.0, 10, 8, 8], [12, 10, 8, 8], [15, 10, 8, 8], [40, 40, 8, 8], [60, 60, 8, 8]])
    assert suppressed(boxes, np.array([1.0, 2.0, 0.5, 0.7, -0.1])).tolist() == [1, 3, 2]
    assert suppressed(boxes, -np.ones(5)).tolist() == []


def test_detections_bring_the_track_back() -> None:
    """The target jumps by two sides in frame 12: with detections the track follows, without it mostly does not."""
    off = {}
    for detect in (True, False):
        errors = []
        for seed in range(4):
            scene = blob(seed, count=30, speed=0.5)
            frames = [f if k < 12 else Frame(np.roll(f.image, 24, 1), k, k / 30, 8) for k, (f, _) in enumerate(scene)]
            x, y = scene[-1][1]
            last = follow(make("hog_pf", {"detect": detect}), frames, Box(*scene[0][1], 14, 10), seed)[-1]
            errors.append(np.hypot(last.center[0] - x - 24, last.center[1] - y))
        off[detect] = np.array(errors)
    assert (off[True] < 5).sum() >= 3
    assert np.median(off[False]) > 15


def test_roc_figures_by_hand() -> None:
    scores, positive = np.array([3.0, 2, 2, 1, 0]), np.array([True, True, False, True, False])
    assert area_under_roc(scores, positive) == pytest.approx((2 + 1.5 + 1) / 6)
    assert detection_rate(scores, positive, 0.5) == pytest.approx(2 / 3)
    assert area_under_roc(-scores, positive) == pytest.approx(1 - 4.5 / 6)


@pytest.mark.slow
def test_roc_on_unseen_seeds() -> None:
    """Windows of seeds that no training has seen; the card's figures are no better."""
    model = make("hog_pf").classifier  # type: ignore[attr-defined]  # of this tracker
    margins, classes = [], []
    for part in windows_of(labelled_frames([2000], SCENARIOS), model.standard):
        margins.append(model.margins(part.region, part.given))
        classes.append(part.positive)
    figures = roc_scores(np.concatenate(margins), np.concatenate(classes))
    print(figures)
    assert figures["area under ROC"] > 0.97
    assert figures["detection rate at 1 % false alarms"] > 0.75


@pytest.mark.slow
def test_contrast_and_occlusion_are_weak_points() -> None:
    """The source names both: the probability of the true window falls with the contrast and with the hidden share."""
    model = make("hog_pf").classifier  # type: ignore[attr-defined]  # of this tracker
    means = []
    for contrast in (1.0, 0.4, 0.1):
        row = []
        for hidden in (0.0, 0.5, 0.8):
            margins = []
            for seed in range(3):
                source = irsim.open_source("examples/ground").with_seed(3000 + seed)
                frame, truth = source.frame(30, input="display"), source.truth(30)
                assert truth is not None
                box = box_of(truth.targets[0])
                image = frame.image.astype(float)
                left, right = round(box.left), round(box.left + hidden * box.w)
                top, bottom = round(box.top) - 1, round(box.bottom) + 2
                level = np.median(image[top - 4 : bottom + 4, left - 4 : round(box.right) + 4])
                around = np.s_[top:bottom, left - 1 : round(box.right) + 2]
                image[around] = level + contrast * (image[around] - level)
                image[top:bottom, left:right] = level
                clip = np.clip(np.rint(image), 0, 255).astype(np.uint8)
                labelled = LabelledFrame(clip, truth.targets, "ground", seed, 30)
                part = next(iter(windows_of([labelled], model.standard)))
                margins.append(model.margins(part.region, np.array([[box.cx, box.cy, box.w, box.h]]))[0])
            row.append(float(np.exp(model.svm.log_probabilities(np.array(margins))).mean()))
        means.append(row)
    print(np.round(means, 2).tolist())
    table = np.array(means)
    assert (table[0, 0] > table[:, 2]).all()
    assert table[0, 0] > table[2, 0]

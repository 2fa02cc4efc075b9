"""Assignment of detections to several Kalman filters, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from irtrack.filters.association import Rules, Tracks, advance

RULES = Rules(acceleration=0.1, measurement_sd=1.0, partial=30.0, neighbour=12.0, gate=13.8, seen=0.5)


def tracks(*places: tuple[float, float, float, float], misses: int = 0) -> Tracks:
    made = Tracks.of(np.array(places), np.repeat(np.eye(4)[None], len(places), 0), np.ones(len(places)), 20)
    made.misses[0] = misses
    return made


def test_a_neighbours_detection_is_not_the_targets() -> None:
    """One detection 2 px from both predictions: the neighbour was detected in the last frame, the target was not."""
    before = tracks((50, 50, 1, 0), (55, 50, 0, 0), misses=1)
    after = advance(before, np.array([[53.0, 50.0]]), np.array([1.0]), (0.0, 0.0), RULES)
    assert after.misses.tolist() == [2, 0]
    assert after.mean[0] == pytest.approx([51, 50, 1, 0])  # predicted


def test_all_detections_are_assigned_at_once() -> None:
    """The nearest detection to the first, 1 px off, is the only one for the second; the first takes the other."""
    before = tracks((50, 50, 0, 0), (53, 50, 0, 0))
    after = advance(before, np.array([[51.0, 50.0], [48.0, 50.0]]), np.ones(2), (0.0, 0.0), RULES)
    assert after.mean[0, 0] < 50
    assert after.mean[1, 0] < 53
    assert len(after.mean) == 2


def test_a_partly_hidden_target_coasts() -> None:
    before = tracks((50, 50, 1, 0))
    part, whole = (
        advance(before, np.array([[50.0, 50.0]]), np.array([height]), (0.0, 0.0), RULES) for height in (0.6, 1.0)
    )
    assert part.mean[0] == pytest.approx([51, 50, 1, 0])
    assert part.misses[0] == 0
    assert whole.mean[0, 0] < 51


def test_tracks_move_with_the_scene_and_ghosts_end() -> None:
    before = tracks((50, 50, 0, 0))
    born = advance(before, np.array([[50.0, 50.0], [90.0, 20.0]]), np.ones(2), (0.0, 0.0), RULES)
    assert len(born.mean) == 2
    after = advance(born, np.array([[53.0, 50.0]]), np.ones(1), (3.0, 0.0), RULES)
    assert after.mean[0, :2] == pytest.approx([53, 50])
    assert len(after.mean) == 1

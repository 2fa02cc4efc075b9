"""Tracks of a running tracker, for a viewer: each frame that is shown is passed to the tracker in its turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irsim import Overlay, TrackState
from irsim.types import Frame, Input, Source, Truth
from irtrack.replay.many import ManyPlayer
from irtrack.replay.replay import Player, replay, show
from irtrack.types import Estimate


def overlay(player: Player | ManyPlayer, source: Source, input: Input) -> Overlay:
    """Return the tracks of a player as an overlay of `irsim.LiveServer`.

    A frame after the last one seen takes the tracker through the frames between, without waiting; an earlier one shows
    the states found before.
    """
    first = player.start.frame if isinstance(player, Player) else 0
    found: dict[int, list[TrackState]] = {}

    def states(counts: Frame, display: Frame, truth: Truth | None) -> Sequence[TrackState]:
        following = first + len(found)
        if counts.index >= following:

            def see(frame: Frame) -> None:
                player.see(frame)
                found[frame.index] = [track_state(frame.index, frame.time, *each) for each in _estimates(player)]

            if following < counts.index:
                replay(source, [see], input, following, counts.index)
            show([(counts if input == "counts" else display, truth)], [see])
        return found.get(counts.index, [])

    return Overlay(player.label, states)


def _estimates(player: Player | ManyPlayer) -> Sequence[tuple[Estimate, int | None, bool | None]]:
    """Return (estimate, id, whether confirmed) of each track of the last frame."""
    if isinstance(player, Player):
        return [(player.estimate, None, None)]
    tracks = player.last
    if tracks is None:
        return []
    return [(each, id, bool(tracks.confirmed[k])) for k, (id, each) in enumerate(tracks.estimates())]


def track_state(
    index: int, time: float, estimate: Estimate, id: int | None = None, confirmed: bool | None = None
) -> TrackState:
    """Return an estimate for frame `index` at `time` s as a state of a track recording."""
    covariance = None
    if estimate.covariance is not None:
        (xx, xy), (yx, yy) = np.asarray(estimate.covariance, dtype=np.float64).tolist()
        covariance = ((xx, xy), (yx, yy))
    return TrackState(
        index=index,
        time=time,
        box=estimate.box,
        status=estimate.status,
        score=estimate.score,
        velocity=estimate.velocity,
        covariance=covariance,
        neff=estimate.neff,
        id=id,
        confirmed=confirmed,
    )

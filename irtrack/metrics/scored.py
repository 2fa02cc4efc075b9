"""A track scored against the source that it was run on."""

from __future__ import annotations

from pathlib import Path

import irsim
from irsim.types import Source
from irtrack import metrics
from irtrack.errors import InputError
from irtrack.metrics import Reference, Score
from irtrack.types import Track


def score(track: Track, against: Reference | str | Path | irsim.Scenario | Source) -> Score:
    """The figures of a track; the start frame, given to the tracker, is not scored.

    against   the source that the track was run on, as `irtrack.run` takes it: a scenario is rendered again for its
              truth. Or a `Reference`, of any frames; those that the track has not seen are left out.

    InputError for what is no track, for another source than the track's, and as `irsim.open_source`.
    """
    if not isinstance(track, Track):
        raise InputError(f"track: a {type(track).__name__} is none; allowed: a Track, as irtrack.run gives it")
    if isinstance(against, Reference):
        return metrics.score(track, against)
    source = irsim.open_source(against)
    if source.hash != track.source_hash:
        seeds = "" if source.seed == track.scene_seed else f" with seed {track.scene_seed}, not {source.seed}"
        raise InputError(
            f"source: {source.name} is not what the track was run on; allowed: {track.source}{seeds}, unchanged"
        )
    return metrics.score(track, Reference.of(source.truths(), track.target))

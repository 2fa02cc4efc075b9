"""Hypothesis strategies for whole scenarios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from irsim.config.yaml_text import write_yaml
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.strategies.scenes import (
    ANY,
    Part,
    Severity,
    camera_motions,
    clutters,
    crossings,
    decoys,
    frame_faults,
    noises,
    occlusions,
    paths,
    seeds,
    shapes,
    skies,
)

SIZE, FRAMES, IFOV_MRAD = (96, 72), 30, 0.5
"""Defaults of `documents`: small enough to render hundreds, large enough for track loss."""


@st.composite
def documents(
    draw: st.DrawFn,
    *,
    size: Sequence[int] = SIZE,
    frames: int = FRAMES,
    camera: Mapping[str, Any] | None = None,
    path: SearchStrategy[Part] | None = None,
    shape: SearchStrategy[Part] | None = None,
    background: SearchStrategy[Part] | None = None,
    noise: SearchStrategy[Part] | None = None,
    motion: SearchStrategy[list[Part]] | None = None,
    faults: SearchStrategy[list[Part]] | None = None,
    occlusion: SearchStrategy[list[Part]] | None = None,
    crossing: SearchStrategy[list[Part]] | None = None,
    decoy: bool | Severity = True,
    seed: SearchStrategy[int] | None = None,
) -> dict[str, Any]:
    """Draw a scenario as plain YAML values: one target, `target`, and its difficulties.

    size      (columns, rows) px;  camera: keys that take precedence over drawn ones
    decoy     severities of a decoy beside the target; False: there is none
    Each of the other arguments is a strategy of `irsim.strategies`, or `st.just(...)` for a fixed value.
    """

    def drawn(given: SearchStrategy[Any] | None, default: SearchStrategy[Any]) -> Any:
        return draw(default if given is None else given)

    way = drawn(path, paths(size, frames))
    look = drawn(shape, shapes())
    behind = drawn(background, skies() | clutters())
    grain = drawn(noise, noises())
    likes = draw(decoys(way, look, ANY if decoy is True else decoy)) if decoy is not False else []
    crosser = drawn(crossing, crossings(frames=frames, shape=look))
    hiding = drawn(occlusion, occlusions(frames=frames))
    shaking = drawn(motion, camera_motions())
    lost = drawn(faults, frame_faults())
    return {
        "seed": drawn(seed, seeds()),
        "frames": frames,
        "camera": {
            "size": list(size),
            "ifov_mrad": IFOV_MRAD,
            "range_k": [270.0, 330.0],
            **grain,
            "motion": shaking,
            "faults": lost,
            **(camera or {}),
        },
        "background": behind,
        "targets": [{"id": "target", "shape": look, "path": way}, *likes, *crosser],
        "occluders": hiding,
        "follow": "target",
    }


def scenarios(**kwargs: Any) -> SearchStrategy[Scenario]:
    """Return a strategy of validated scenarios; the arguments are those of `documents`."""
    return documents(**kwargs).map(write_yaml).map(loads)

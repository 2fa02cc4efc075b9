"""Strategies for whole scenarios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from irsim.config.yaml_text import write_yaml
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.strategies import parts
from irsim.strategies.parts import Part

SIZE, FRAMES, IFOV_MRAD = (96, 72), 30, 0.5
"""Of scenes that are small enough to be rendered by the hundred, and large enough to be lost in."""


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
    decoy: bool | SearchStrategy[int] = True,
    seed: SearchStrategy[int] | None = None,
) -> dict[str, Any]:
    """A scenario as YAML has it: one target, `target`, and what makes it hard.

    size      (columns, rows) px;  camera: keys that go before what is drawn
    decoy     severities of a like beside the target; False: there is none
    Each of the others is a strategy of `irsim.strategies`, `st.just(...)` for what is not to be drawn.
    """
    way = draw(parts.chosen(path, parts.paths(size, frames)))
    look = draw(parts.chosen(shape, parts.shapes()))
    behind = draw(parts.chosen(background, st.one_of(parts.skies(), parts.clutters())))
    grain = draw(parts.chosen(noise, parts.noises()))
    likes = draw(parts.decoys(way, look, None if decoy is True else decoy)) if decoy is not False else []
    crosser = draw(parts.chosen(crossing, parts.crossings(frames=frames, shape=look)))
    hiding = draw(parts.chosen(occlusion, parts.occlusions(frames=frames)))
    shaking = draw(parts.chosen(motion, parts.camera_motions()))
    lost = draw(parts.chosen(faults, parts.frame_faults()))
    return {
        "seed": draw(parts.chosen(seed, parts.seeds())),
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
    """The scenarios of `documents`, whose arguments it takes."""
    return documents(**kwargs).map(write_yaml).map(loads)

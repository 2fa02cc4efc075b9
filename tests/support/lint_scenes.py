"""Scenarios for the tests of warnings: what is written as a mapping, and its warnings by place."""

from __future__ import annotations

from typing import Any

from irsim.lint import lint
from irsim.scenario.model import Scenario

SKY = {"kind": "sky", "horizon_k": 285.0, "zenith_k": 250.0}


def warned(scene: dict[str, Any]) -> dict[str, str]:
    """Return the messages by place, several joined by newlines; by default of 31 frames of 64 x 48 px before a sky."""
    size = {"size": (64, 48), **scene.get("camera", {})}
    whole = {"frames": 31, "background": SKY, **scene, "camera": size}
    found: dict[str, str] = {}
    for notice in lint(Scenario.model_validate(whole)):
        place = ".".join(map(str, notice.at))
        found[place] = "\n".join(filter(None, (found.get(place), notice.message)))
    return found


def point(**path: Any) -> dict[str, Any]:
    """Return a point target named `it` at rest in the middle of 64 x 48 px."""
    return {"id": "it", "shape": {"kind": "point"}, "path": {"kind": "straight", "start": (32, 24), **path}}


def check_warning(scene: dict[str, Any], place: str | None, words: str = "") -> None:
    """Assert the only warning's place and words, or silence for no place."""
    found = warned(scene)
    assert list(found) == ([] if place is None else [place])
    assert all(words in message for message in found.values())

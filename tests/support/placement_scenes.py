"""Scenarios with an occluder placed to hide a tank, and the fractions of it that the ground truth has visible."""

from __future__ import annotations

from irsim import loads
from irsim.render.frame import Renderer

SCENE = """
frames: 70
camera:
  size: [120, 80]
  netd_mk: 0
  elevation_deg: -5
  motion: [{kind: jitter, rms_px: 0.5}, {kind: pan, azimuth_deg_s: 0.1}]
background: {kind: ground, spread_k: 0}
targets:
  - {id: tank, shape: {kind: SHAPE}, path: {kind: straight, range_m: 900, start: [15, 50], HOW}}
occluders:
  - {kind: KIND, hides: tank, frames: [30, 36], fraction: FRACTION, range_m: 200}
"""
DOWNWARDS = {"[15, 50]": "[60, 2]"}


def scene(
    kind: str, fraction: float = 1.0, shape: str = "tank", heading: float = 0.0, change: dict[str, str] | None = None
) -> str:
    """Return the text of a scenario, with each key of `change` replaced by its value."""
    text = SCENE.replace("KIND", kind).replace("FRACTION", str(fraction)).replace("SHAPE", shape)
    text = text.replace("HOW", f"speed: 1.2, heading_deg: {heading}")
    for old, new in (change or {}).items():
        text = text.replace(old, new)
    return text


def visible(text: str, frames: range = range(70), overrides: tuple[str, ...] = ()) -> list[float]:
    """Return the visible fraction of the first target in each frame."""
    renderer = Renderer(loads(text, overrides=overrides))
    found = [renderer.scene(frame)[1].targets[0].visible for frame in frames]
    assert None not in found
    return [share for share in found if share is not None]

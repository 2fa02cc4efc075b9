"""A hot dot that moves on even ground: plain enough for trackers that run as programs."""

from __future__ import annotations

import irsim

SCENE = """
frames: 12
camera: {size: [64, 48], netd_mk: 20, bits: 14}
background: {kind: ground, spread_k: 0}
targets:
  - id: dot
    shape: {kind: hot_spot, size_m: [3, 3], temperature_k: 340}
    path: {kind: straight, start: [20, 20], speed: 1.5}
"""


def scene() -> irsim.Rendering:
    return irsim.Rendering(irsim.loads(SCENE), "dot")

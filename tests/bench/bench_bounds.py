"""Cost of bounds at 640x512 px, a frame and target, beyond the noiseless background of the frame."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from time import perf_counter

import irsim

FRAMES = 30
POINT = "targets.jet.shape={kind: point, area_m2: 0.2}"
LINES = "camera.noise=[{kind: noise_3d, tvh: 1, tv: 0.3, th: 0.3}]"


def bounds() -> Iterator[tuple[str, float]]:
    """Yield (name, ms): medians for a body and a point, for a body in row and column noise, and of clutter."""
    for name, changes, clutter in (
        ("bounds_body", [], False),
        ("bounds_point", [POINT], False),
        ("bounds_body_lines", [LINES], False),
        ("bounds_body_clutter", [], True),
    ):
        scenario = irsim.load("sky", ["camera.size=[640,512]", f"frames={FRAMES}", *changes])
        found = irsim.FrameBounds(scenario, ["jet"], clutter=clutter)
        times = []
        for index in range(FRAMES):
            found.of(index)  # renders the frame's background, which is kept
            begin = perf_counter()
            found.of(index)
            times.append(perf_counter() - begin)
        yield f"{name}_640x512", 1e3 * statistics.median(times)


if __name__ == "__main__":
    for row in bounds():
        print(*row)

"""Cost of a step: CPU time against the number of particles, the target's window and the frame."""

from __future__ import annotations

from irtrack.papers.experiment import BETTER, Paper, Scene, Sweep, claims
from irtrack.papers.rules import cpu, less

SEEDS = 5
"""Number of seeds; few are enough, since times vary little."""
FRAMES = 40
METRES_A_PX = 2050 * 0.5e-3
"""Metres per pixel at the target of cheng-sky: its distance, m, times the angle of a pixel, rad."""

PARTICLES = (25, 50, 100, 200, 400, 800)
WINDOWS = ((5, 5), (10, 7), (14, 10), (28, 20), (40, 28), (60, 42))
FRAME_SIZES = ((160, 120), (320, 240), (640, 480), (1280, 960))
MIDDLE, FRAME = (14, 10), (320, 240)

ONE_LAYER = ("grey_pf", "product_pf", "mean_shift_pf", "background_restrained_pf", "fusion_wspf", "svd_pf")
STEPS = {name: name for name in ("cascade_pf", *ONE_LAYER)} | {
    name: name for name in ("template", "kalman", "mean_shift", "optical_flow", "camshift_kalman")
}


def scene(window: tuple[int, int], size: tuple[int, int]) -> Scene:
    """Return the scene with a target of `window` px in a frame of `size` px."""
    width, height = (METRES_A_PX * side for side in window)
    return Scene(
        f"cost {window[0]}x{window[1]} in {size[0]}x{size[1]}",
        "sources/cheng-sky",
        (
            f"frames={FRAMES}",
            f"camera.size=[{size[0]}, {size[1]}]",
            f"targets.jet.shape={{kind: hot_spot, size_m: [{width:g}, {height:g}], temperature_k: 290}}",
        ),
    )


def with_particles(n: int) -> dict[str, str]:
    """Return the specs of the filters at N particles in total; the first layer of the cascade has two thirds of
    them."""
    n2 = n // 3
    return {name: f"{name}:particles={n}" for name in ONE_LAYER} | {"cascade_pf": f"cascade_pf:n1={n - n2}:n2={n2}"}


SLOW, PLACE, SLOWER = "Template matching is slow on large", "Cheng 2006, introduction", less(cpu, "grey_pf", "template")

COST = Paper(
    key="cost",
    title="Cost of a step",
    seeds_at_most=SEEDS,
    remark=(
        f"Median CPU time of a step, one thread, mean over {SEEDS} scenes of {FRAMES} frames; a target of 14 × 10 px "
        "in frames of 320 × 240 px where neither varies. N is the number of particles in all."
    ),
    claims=(
        *claims(scene(MIDDLE, FRAME_SIZES[-1]), (f"{SLOW} frames.", PLACE, SLOWER)),
        *claims(scene(WINDOWS[-1], FRAME), (f"{SLOW} targets.", PLACE, SLOWER)),
    ),
    sweeps=tuple(
        Sweep(f"Against {title}", x, points, {"CPU time of a step, ms": cpu}, log=True)
        for title, x, points in (
            ("the number of particles", "N", {float(n): (scene(MIDDLE, FRAME), with_particles(n)) for n in PARTICLES}),
            (
                "the target's window",
                "width of the target, px",
                {float(window[0]): (scene(window, FRAME), STEPS | BETTER) for window in WINDOWS},
            ),
            (
                "the frame",
                "width of the frame, px",
                {float(size[0]): (scene(MIDDLE, size), STEPS | BETTER) for size in FRAME_SIZES},
            ),
        )
    ),
)

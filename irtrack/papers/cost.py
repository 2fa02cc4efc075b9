"""What a step costs: CPU time against the number of particles, the target's window and the frame."""

from __future__ import annotations

from irtrack.papers.ours import BETTER
from irtrack.papers.rules import cpu, less
from irtrack.papers.values import Claim, Paper, Scene, Sweep

SEEDS = 5
"""Scenes are short and times hardly vary: a few are enough."""
FRAMES = 40
METRES_A_PX = 2050 * 0.5e-3
"""Of a target in cheng-sky: range times the angle of a pixel."""

PARTICLES = (25, 50, 100, 200, 400, 800)
WINDOWS = ((5, 5), (10, 7), (14, 10), (28, 20), (40, 28), (60, 42))
FRAME_SIZES = ((160, 120), (320, 240), (640, 480), (1280, 960))

FILTERS = {
    "grey_pf": "grey_pf:particles={n}",
    "cascade_pf": "cascade_pf:n1={n1}:n2={n2}",
    "product_pf": "product_pf:particles={n}",
    "mean_shift_pf": "mean_shift_pf:particles={n}",
    "background_restrained_pf": "background_restrained_pf:particles={n}",
    "fusion_wspf": "fusion_wspf:particles={n}",
    "svd_pf": "svd_pf:particles={n}",
}
"""Filters of particles; the cascade has two of three in its first layer, as the paper's 30 and 15."""

STEPS = {name: name for name in FILTERS} | {
    name: name for name in ("template", "kalman", "mean_shift", "optical_flow", "camshift_kalman")
}


def scene(window: tuple[int, int], size: tuple[int, int]) -> Scene:
    """A target of `window` px in a frame of `size` px."""
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
    """The filters at N particles in all."""
    n2 = n // 3
    return {label: spec.format(n=n, n1=n - n2, n2=n2) for label, spec in FILTERS.items()}


MIDDLE, FRAME = (14, 10), (320, 240)
TIME = {"CPU time of a step, ms": cpu}

COST = Paper(
    key="cost",
    title="What a step costs",
    seeds_at_most=SEEDS,
    remark=(
        f"Median CPU time of a step, one thread, mean over {SEEDS} scenes of {FRAMES} frames; a target of 14 × 10 px "
        "in frames of 320 × 240 px where neither varies. N is the number of particles in all."
    ),
    claims=(
        Claim(
            "Template matching is slow on large frames, for it searches all of them.",
            "Cheng 2006, introduction",
            scene(MIDDLE, FRAME_SIZES[-1]).name,
            less(cpu, "CPU time", "grey_pf", "template"),
        ),
        Claim(
            "Template matching is slow on large targets.",
            "Cheng 2006, introduction",
            scene(WINDOWS[-1], FRAME).name,
            less(cpu, "CPU time", "grey_pf", "template"),
        ),
    ),
    sweeps=(
        Sweep(
            "Against the number of particles",
            "N",
            {float(n): (scene(MIDDLE, FRAME), with_particles(n)) for n in PARTICLES},
            TIME,
            log=True,
        ),
        Sweep(
            "Against the target's window",
            "width of the target, px",
            {float(window[0]): (scene(window, FRAME), STEPS | BETTER) for window in WINDOWS},
            TIME,
            log=True,
        ),
        Sweep(
            "Against the frame",
            "width of the frame, px",
            {float(size[0]): (scene(MIDDLE, size), STEPS | BETTER) for size in FRAME_SIZES},
            TIME,
            log=True,
        ),
    ),
)

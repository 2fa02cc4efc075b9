"""Experiments of Cheng, Zhou, Cai, Yang 2006: a particle filter on the grey histogram, with adaptive noise."""

from __future__ import annotations

from irtrack.papers.experiment import Choice, Claim, Experiment, Paper, Printed, Scene, Untested, claims, switches
from irtrack.papers.rules import as_near, cpu, error_over, holds, less, loses, nearer, no_worse

SKY, GROUND = Scene.of("cheng-sky"), Scene.of("cheng-ground")
HALF_HIDDEN = Scene(
    "half hidden", "stress/occlusion", ("occluders.screen.fraction=0.5", "occluders.screen.frames=[40, 60]")
)
TURNING = Scene("turning", "stress/yawing-jet")

FILTERS = {
    "grey_pf": "grey_pf",
    "16 bins": "grey_pf:bins=16",
    "256 bins": "grey_pf:bins=256",
    "no update": "grey_pf:update=false",
    "N = 25": "grey_pf:particles=25",
    "N = 400": "grey_pf:particles=400",
    "N by KLD": "grey_pf:adapt=kld",
    "N by Neff": "grey_pf:adapt=neff",
    "damped": "grey_pf:damping=0.7",
    "fixed R = 1": "grey_pf:noise=fixed:r0=1",
    "fixed R = 4": "grey_pf:noise=fixed:r0=4",
    "fixed R = 12": "grey_pf:noise=fixed:r0=12",
    "fixed R = 12, N = 400": "grey_pf:noise=fixed:r0=12:particles=400",
}
KALMANS = {
    f"kalman {measurement.replace('_', ' ')}": f"kalman:measurement={measurement}"
    for measurement in ("centroid", "ncc", "mean_shift")
}
BASELINES = {name: name for name in ("template", "optical_flow")} | KALMANS | {"ekf": "ekf", "mean_shift": "mean_shift"}
FIXED = Choice((SKY, GROUND), tuple(f"grey_pf:noise=fixed:r0={r}" for r in (0.5, 1, 2, 3, 4, 5, 7, 10)))
"""Choice of the best fixed noise, one value for both scenes, since the adaptive noise has one setting for both."""


def on_both(scene: Scene) -> tuple[Claim, ...]:
    """Return the claims that the paper makes of its filter without naming a scene."""
    rivals = {"template": "template matching", "optical_flow": "optical flow"}
    rivals |= dict.fromkeys(KALMANS, "the Kalman filter") | {"ekf": "the extended Kalman filter"}
    return claims(
        scene,
        ("32 levels do as well as 256.", "section 3", as_near("grey_pf", "256 bins")),
        ("16 levels do as well as 32.", "section 3", as_near("16 bins", "grey_pf")),
        ("Fewer levels save time.", "section 3", less(cpu, "grey_pf", "256 bins")),
        (
            "More particles make the filter more robust (400 for 100).",
            "section 3",
            nearer("N = 400", "grey_pf"),
        ),
        (
            "Fewer particles make the filter less robust (25 for 100).",
            "section 3",
            nearer("grey_pf", "N = 25"),
        ),
        ("More particles take more time.", "section 3", less(cpu, "grey_pf", "N = 400")),
        ("Choosing N in each frame helps.", "sections 3, 4", nearer("N by KLD", "grey_pf")),
        ("Choosing N in each frame helps.", "sections 3, 4", nearer("N by Neff", "grey_pf")),
        ("Small noise fails in manoeuvres.", "section 2.4", nearer("fixed R = 4", "fixed R = 1")),
        ("Large noise needs more particles.", "section 2.4", nearer("fixed R = 12, N = 400", "fixed R = 12")),
        ("Adaptive noise is more robust than fixed noise.", "section 2.4", nearer("grey_pf", "fixed R = 4")),
        (
            "Updating the reference makes the filter more robust.",
            "section 2.4",
            nearer("grey_pf", "no update"),
        ),
        (
            "Damping the motion by .7 does as well.",
            "section 2.1",
            no_worse("damped", "grey_pf"),
        ),
        *(
            (f"The filter is better than {words}.", "sections 3, 4", nearer("grey_pf", label))
            for label, words in rivals.items()
        ),
    )


def nearer_at_first(scene: Scene) -> tuple[Claim, ...]:
    """Return the claims of figure 3, over the first 50 frames."""
    text = "The particle filter's error is below the Kalman filter's over the first 50 frames."
    return claims(scene, *((text, "figure 3", less(error_over(1, 50), "grey_pf", label)) for label in KALMANS))


MECHANISMS = (
    ("model update", "grey_pf", "grey_pf:update=false"),
    ("small R0 (2) against 10", "grey_pf:r0=2", "grey_pf"),
    ("large R0 (30) against 10", "grey_pf:r0=30", "grey_pf"),
    ("large R0 (30), N = 400 against 100", "grey_pf:r0=30:particles=400", "grey_pf:r0=30"),
    ("16 bins against 32", "grey_pf:bins=16", "grey_pf"),
    ("bins over the first frame's range against the full one", "grey_pf", "grey_pf:bins_range=full"),
    ("damping .7 against the paper's undamped AR(2)", "grey_pf:damping=0.7", "grey_pf"),
    ("systematic against multinomial resampling", "grey_pf:resampling=systematic", "grey_pf"),
    ("N = 400 against 100", "grey_pf:particles=400", "grey_pf"),
    ("N by KLD", "grey_pf:adapt=kld", "grey_pf"),
    ("N by Neff", "grey_pf:adapt=neff", "grey_pf"),
    ("adaptive noise against the best fixed one", "grey_pf", FIXED),
)


def experiment(scene: Scene, title: str, hz: float, letter: str) -> Experiment:
    remark = f"The chart is the paper's figure 3 ({letter}), over all frames."
    printed, charted = {"grey_pf": Printed(ms=1000 / hz)}, ("grey_pf", *BASELINES)
    return Experiment(scene, title, FILTERS | BASELINES, printed, remark, scene.siblings, charted)


CHENG = Paper(
    key="cheng",
    title="Cheng, Zhou, Cai, Yang 2006: infrared object tracking based on particle filters",
    remark=(
        "The paper does not say what its Kalman filter measures, and that decides the comparison: three measurements "
        "are reported, the centroid of bright pixels in a gate, correlation in a window, and mean shift. Two scenes "
        "are not the paper's: a car half hidden for 21 frames, and a jet that yaws by 120 degrees a second; the "
        "paper claims both for grey levels."
    ),
    experiments=(
        experiment(SKY, "First experiment: an aircraft before the sky", 8, "a"),
        experiment(GROUND, "Second experiment: a tank in ground clutter", 3, "b"),
        Experiment(HALF_HIDDEN, "Half of a car hidden", {"grey_pf": "grey_pf", "template": "template"}),
        Experiment(TURNING, "A jet that yaws", {"grey_pf": "grey_pf", "template": "template"}),
    ),
    claims=(
        *claims(SKY, ("The filter follows the manoeuvring, deforming aircraft.", "section 3", holds("grey_pf"))),
        *claims(GROUND, ("The filter follows the tank in strong clutter.", "section 3", holds("grey_pf"))),
        *claims(HALF_HIDDEN, ("Grey levels tolerate partial occlusion.", "section 2.2", holds("grey_pf"))),
        *claims(TURNING, ("Grey levels tolerate rotation and deformation.", "section 2.2", holds("grey_pf"))),
        *claims(
            SKY,
            ("Template matching loses the aircraft.", "section 3", loses("template")),
            ("Optical flow follows the aircraft.", "section 3", holds("optical_flow")),
            *(("The Kalman filter fails in manoeuvres.", "section 3", loses(label)) for label in KALMANS),
        ),
        *claims(
            GROUND,
            ("Template matching follows the tank.", "section 3", holds("template")),
            ("Template matching is slower than the particle filter.", "section 3", less(cpu, "grey_pf", "template")),
            ("Optical flow cannot follow the tank in clutter.", "section 3", loses("optical_flow")),
        ),
        *(claim for of in (nearer_at_first, on_both) for scene in (SKY, GROUND) for claim in of(scene)),
    ),
    untested=(
        Untested("Learned motion models adapt poorly.", "section 2.1", "no tracker here learns a motion model"),
        Untested(
            "Other sampling would improve the filter.",
            "section 4",
            "the paper names none; the ablations below show those of grey_pf",
        ),
    ),
    switches=switches(SKY, *MECHANISMS) + switches(GROUND, *MECHANISMS),
)

"""Cheng, Zhou, Cai, Yang 2006: a particle filter on the grey histogram, with adaptive noise."""

from __future__ import annotations

from irtrack.papers.rules import cpu, error_over, holds, less, loses, nearly, off_share
from irtrack.papers.values import Choice, Claim, Experiment, Paper, Printed, Rival, Scene, Switch, Untested

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
BASELINES = {
    "template": "template",
    "optical_flow": "optical_flow",
    "kalman centroid": "kalman:measurement=centroid",
    "kalman ncc": "kalman:measurement=ncc",
    "kalman mean shift": "kalman:measurement=mean_shift",
    "ekf": "ekf",
    "mean_shift": "mean_shift",
}
KALMANS = ("kalman centroid", "kalman ncc", "kalman mean shift")
FIXED = Choice((SKY, GROUND), tuple(f"grey_pf:noise=fixed:r0={r}" for r in (0.5, 1, 2, 3, 4, 5, 7, 10)))
"""The best fixed noise, one for both scenes as the adaptive one is."""

first_50 = error_over(1, 50)


def less_off(label: str, other: str, scene: Scene, text: str, place: str) -> Claim:
    return Claim(text, place, scene.name, less(off_share, "share of frames off", label, other))


def on_both(scene: Scene) -> tuple[Claim, ...]:
    """What the paper says of its filter, without a scene."""
    return (
        *(
            Claim(
                f"Quantisation to {words} hardly matters.",
                "section 3",
                scene.name,
                nearly(off_share, "share of frames off", own, other, 0.05),
            )
            for words, own, other in (
                ("32 levels in place of 256", "grey_pf", "256 bins"),
                ("16 levels in place of 32", "16 bins", "grey_pf"),
            )
        ),
        Claim("It saves time.", "section 3", scene.name, less(cpu, "CPU time", "grey_pf", "256 bins")),
        less_off("N = 400", "grey_pf", scene, "More particles make it more robust (400 for 100).", "section 3"),
        less_off("grey_pf", "N = 25", scene, "Fewer particles make it less robust (25 for 100).", "section 3"),
        Claim("More particles take more time.", "section 3", scene.name, less(cpu, "CPU time", "grey_pf", "N = 400")),
        *(
            less_off(label, "grey_pf", scene, "Choosing N in each frame helps.", "sections 3, 4")
            for label in ("N by KLD", "N by Neff")
        ),
        less_off("fixed R = 4", "fixed R = 1", scene, "Small noise bears manoeuvres less well.", "section 2.4"),
        less_off("fixed R = 12, N = 400", "fixed R = 12", scene, "Large noise needs more particles.", "section 2.4"),
        less_off("grey_pf", "fixed R = 4", scene, "Adaptive noise is more robust than fixed noise.", "section 2.4"),
        less_off("grey_pf", "no update", scene, "Updating the reference makes it more robust.", "section 2.4"),
        Claim(
            "It does not hang too much on the motion model (displacements damped by .7 do about as well).",
            "section 2.1",
            scene.name,
            nearly(off_share, "share of frames off", "damped", "grey_pf", 0.05),
        ),
        *(
            less_off("grey_pf", label, scene, f"It is better than {words}.", "sections 3, 4")
            for label, words in (
                ("template", "template matching"),
                ("optical_flow", "optical flow"),
                *((label, "the Kalman filter") for label in KALMANS),
                ("ekf", "the extended Kalman filter"),
            )
        ),
    )


CHENG = Paper(
    key="cheng",
    title="Cheng, Zhou, Cai, Yang 2006: infrared object tracking based on particle filters",
    remark=(
        "The paper does not say what its Kalman filter measures, and that decides the comparison: three measurements "
        "are reported, the centroid of what is bright in a gate, correlation in a window, and mean shift. Two scenes "
        "are not the paper's: a car half hidden for 21 frames, and a jet that yaws by 120 degrees a second; the "
        "paper names both as what grey levels bear."
    ),
    experiments=(
        Experiment(
            SKY,
            "First experiment: an aircraft before the sky",
            FILTERS | BASELINES,
            {"grey_pf": Printed(ms=1000 / 8)},
            "The chart is the paper's figure 3 (a), over all frames.",
            SKY.siblings,
            charted=("grey_pf", *BASELINES),
        ),
        Experiment(
            GROUND,
            "Second experiment: a tank in ground clutter",
            FILTERS | BASELINES,
            {"grey_pf": Printed(ms=1000 / 3)},
            "The chart is the paper's figure 3 (b), over all frames.",
            GROUND.siblings,
            charted=("grey_pf", *BASELINES),
        ),
        *(
            Experiment(scene, title, {"grey_pf": "grey_pf", "template": "template"})
            for scene, title in ((HALF_HIDDEN, "Half of a car hidden"), (TURNING, "A jet that yaws"))
        ),
    ),
    claims=(
        Claim(
            "The particle filter follows the manoeuvring, deforming aircraft.", "section 3", SKY.name, holds("grey_pf")
        ),
        Claim("It follows the tank in strong clutter.", "section 3", GROUND.name, holds("grey_pf")),
        Claim("Grey levels bear partial occlusion.", "section 2.2", HALF_HIDDEN.name, holds("grey_pf")),
        Claim("Grey levels bear rotation and deformation.", "section 2.2", TURNING.name, holds("grey_pf")),
        Claim("Template matching can hardly follow the aircraft.", "section 3", SKY.name, loses("template")),
        Claim("Template matching follows the tank.", "section 3", GROUND.name, holds("template")),
        Claim(
            "It is slower than the particle filter there.",
            "section 3",
            GROUND.name,
            less(cpu, "CPU time", "grey_pf", "template"),
        ),
        Claim("Optical flow follows the aircraft.", "section 3", SKY.name, holds("optical_flow")),
        Claim("Optical flow cannot follow the tank in clutter.", "section 3", GROUND.name, loses("optical_flow")),
        *(
            Claim("The Kalman filter can hardly follow irregular manoeuvres.", "section 3", SKY.name, loses(label))
            for label in KALMANS
        ),
        *(
            Claim(
                "The particle filter's error is below the Kalman filter's over the first 50 frames.",
                "figure 3",
                scene.name,
                less(first_50, "error of frames 1 to 50", "grey_pf", label),
            )
            for scene in (SKY, GROUND)
            for label in KALMANS
        ),
        *on_both(SKY),
        *on_both(GROUND),
    ),
    untested=(
        Untested(
            "Motion models that were learned adapt poorly.", "section 2.1", "no tracker here learns a motion model"
        ),
        Untested(
            "Other sampling strategies would improve it.",
            "section 4",
            "the paper names none; the ways of drawing that grey_pf knows are switches below",
        ),
    ),
    switches=tuple(
        Switch(mechanism, scene, with_it, without)
        for scene in (SKY, GROUND)
        for mechanism, with_it, without in (
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
        )
    ),
    rivals=tuple(
        Rival("adaptive noise against the best fixed one", scene, "grey_pf", FIXED) for scene in (SKY, GROUND)
    ),
)

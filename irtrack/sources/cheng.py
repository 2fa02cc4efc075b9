"""Cheng, Zhou, Cai, Yang 2006: a particle filter on the grey histogram, with adaptive noise."""

from __future__ import annotations

from irtrack.sources.rules import error_over, holds, less, loses, ms, nearly, off_share
from irtrack.sources.values import Claim, Experiment, Paper, Printed, Scene, Switch

SKY, GROUND = Scene.of("cheng-sky"), Scene.of("cheng-ground")

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
first_50 = error_over(1, 50)

CHENG = Paper(
    key="cheng",
    title="Cheng, Zhou, Cai, Yang 2006: infrared object tracking based on particle filters",
    remark=(
        "The paper does not say what its Kalman filter measures, and that decides the comparison: three measurements "
        "are reported, the centroid of what is bright in a gate, correlation in a window, and mean shift."
    ),
    experiments=(
        Experiment(
            SKY,
            "First experiment: an aircraft before the sky",
            {"grey_pf": "grey_pf", "16 bins": "grey_pf:bins=16", **BASELINES},
            {"grey_pf": Printed(ms=1000 / 8)},
            "The chart is the paper's figure 3 (a), over all frames.",
            SKY.siblings,
        ),
        Experiment(
            GROUND,
            "Second experiment: a tank in ground clutter",
            {"grey_pf": "grey_pf", "16 bins": "grey_pf:bins=16", **BASELINES},
            {"grey_pf": Printed(ms=1000 / 3)},
            "The chart is the paper's figure 3 (b), over all frames.",
            GROUND.siblings,
        ),
    ),
    claims=(
        Claim(
            "The particle filter follows the manoeuvring, deforming aircraft.", "section 3", SKY.name, holds("grey_pf")
        ),
        Claim("It follows the tank in strong clutter.", "section 3", GROUND.name, holds("grey_pf")),
        Claim("Template matching can hardly follow the aircraft.", "section 3", SKY.name, loses("template")),
        Claim("Template matching follows the tank.", "section 3", GROUND.name, holds("template")),
        Claim(
            "It is slower than the particle filter there.",
            "section 3",
            GROUND.name,
            less(ms, "time", "grey_pf", "template"),
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
        *(
            Claim(
                "Quantisation to 16 or 32 levels hardly matters.",
                "section 3",
                scene.name,
                nearly(off_share, "share of frames off", "16 bins", "grey_pf", 0.05),
            )
            for scene in (SKY, GROUND)
        ),
    ),
    switches=tuple(
        Switch(mechanism, scene, with_it, without)
        for scene in (SKY, GROUND)
        for mechanism, with_it, without in (
            ("adaptive noise against fixed, R = 2", "grey_pf", "grey_pf:noise=fixed:r0=2"),
            ("adaptive noise against fixed, R = 4", "grey_pf", "grey_pf:noise=fixed:r0=4"),
            ("adaptive noise against fixed, R = 7", "grey_pf", "grey_pf:noise=fixed:r0=7"),
            ("model update", "grey_pf", "grey_pf:update=false"),
            ("small R0 (2) against 10", "grey_pf:r0=2", "grey_pf"),
            ("large R0 (30) against 10", "grey_pf:r0=30", "grey_pf"),
            ("large R0 (30), N = 400 against 100", "grey_pf:r0=30:particles=400", "grey_pf:r0=30"),
            ("16 bins against 32", "grey_pf:bins=16", "grey_pf"),
            ("bins over the first frame's range against the full one", "grey_pf", "grey_pf:bins_range=full"),
            ("damping .7 against the paper's undamped AR(2)", "grey_pf:damping=0.7", "grey_pf"),
            ("N = 400 against 100", "grey_pf:particles=400", "grey_pf"),
            ("N by KLD", "grey_pf:adapt=kld", "grey_pf"),
            ("N by Neff", "grey_pf:adapt=neff", "grey_pf"),
        )
    ),
)

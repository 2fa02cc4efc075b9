"""An, Gao, Chen, Wu 2007, and Cui, Zheng, Li 2011, of which an abstract survives."""

from __future__ import annotations

from irtrack.sources.rules import detected, error_all, false_alarms, less
from irtrack.sources.values import Claim, Experiment, Paper, Scene, Sweep, Switch

FALSE, CLOUD = Scene.of("an-false"), Scene.of("cui-cloud")

ESTIMATES = {
    "restrained": "background_restrained_pf",
    "mean": "background_restrained_pf:keep=1",
    "MAP": "background_restrained_pf:estimate=map",
}
LIKENESSES = (0.2, 0.4, 0.6, 0.8, 1.0)
RATIOS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
SVD = {"SVD and PF": "svd_pf", "SVD alone": "svd_pf:use=svd", "PF alone": "svd_pf:use=pf"}

AN = Paper(
    key="an",
    title="An, Gao, Chen, Wu 2007: particle filter with restrained background disturbance",
    remark="With two equally good modes the share of large weight holds both: then the restrained mean is biased too.",
    experiments=(Experiment(FALSE, "A false target beside the true one", ESTIMATES, siblings=FALSE.siblings),),
    claims=(
        Claim(
            "The mean over the particles of large weight is nearer to the target than the mean over all.",
            "section 2",
            FALSE.name,
            less(error_all, "mean error", "restrained", "mean"),
        ),
        Claim(
            "It is nearer than the particle of largest weight, which few particles and noise make poor.",
            "section 2",
            FALSE.name,
            less(error_all, "mean error", "restrained", "MAP"),
        ),
    ),
    sweeps=(
        Sweep(
            "Error against the false target's likeness",
            "contrast of the false target as a share of the true one's",
            {
                likeness: Scene(f"an-false {likeness:g}", "sources/an-false", (f"targets.other.contrast={likeness}",))
                for likeness in LIKENESSES
            },
            ESTIMATES,
            {"mean error, px": error_all},
        ),
    ),
    switches=tuple(
        Switch(
            f"keep by {by}, {keep:g} against all",
            FALSE,
            f"background_restrained_pf:keep={keep}:by={by}",
            ESTIMATES["mean"],
        )
        for by in ("count", "mass")
        for keep in (0.3, 0.6, 0.9)
    ),
)

CUI = Paper(
    key="cui",
    title="Cui, Zheng, Li 2011: SVD background suppression and a particle filter",
    remark=(
        "Detection: frames in which the tracker says that it sees the target and is within 5 px of it; false alarm: "
        "says so and is farther."
    ),
    experiments=(Experiment(CLOUD, "A dim target before cloud, its SCR falling", SVD, siblings=CLOUD.siblings),),
    claims=tuple(
        Claim(
            f"Together they find the target more often than {label}.",
            "abstract",
            CLOUD.name,
            less(lambda run: -(detected(run) or 0.0), "missed detections", "SVD and PF", label),
        )
        for label in ("SVD alone", "PF alone")
    ),
    sweeps=(
        Sweep(
            "Detection and false alarms against SCR",
            "signal-to-clutter ratio",
            {
                ratio: Scene(f"cui-cloud SCR {ratio:g}", "sources/cui-cloud", (f"targets.dim.shape.scr={ratio}",))
                for ratio in RATIOS
            },
            SVD,
            {"detected, share of frames": detected, "false alarms, share of frames": false_alarms},
        ),
    ),
)

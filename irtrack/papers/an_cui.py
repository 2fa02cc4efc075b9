"""Experiments of An, Gao, Chen, Wu 2007 and Cui, Zheng, Li 2011, known only in part; CamShift with a Kalman filter."""

from __future__ import annotations

from irtrack.papers.experiment import Experiment, PairedRule, Paper, Scene, Sweep, Untested, claims, switches
from irtrack.papers.rules import bounded_error, detected, false_alarms, holds, less, loses, lost, missed, nearer

FALSE, CLOUD = Scene.of("an-false"), Scene.of("cui-cloud")

RESTRAINED = "background_restrained_pf"
ESTIMATES = {"restrained": "", "mean": ":keep=1", "MAP": ":keep=1:estimate=map"}
"""The mean over the default share of the particles, and two controls over all particles (keep = 1): mean and MAP."""
TIGHT = {label: RESTRAINED + end for label, end in ESTIMATES.items()}
WIDE_R = 12
"""Fixed noise, px, with which the particles reach the false target and bias the mean, as in the paper."""


def wide(particles: int = 100) -> dict[str, str]:
    """Return the specs of the three estimates with particles that reach the false target."""
    spec = f"{RESTRAINED}:noise=fixed:r0={WIDE_R}:particles={particles}"
    return {label: spec + end for label, end in ESTIMATES.items()}


def alike(likeness: float) -> Scene:
    """Return the scene with a false target whose contrast is `likeness` times that of the true target."""
    return Scene(f"an-false {likeness:g}", "sources/an-false", (f"targets.other.contrast={likeness}",))


def at_ratio(ratio: float) -> Scene:
    """Return the scene with the dim target at a signal-to-clutter ratio."""
    return Scene(f"cui-cloud SCR {ratio:g}", "sources/cui-cloud", (f"targets.dim.shape.scr={ratio}",))


COUNTS = (25, 50, 100, 200, 400)
LIKENESSES = (0.4, 0.7, 0.8, 0.85, 0.9, 0.95, 1.0)
SWEPT = {"bounded error, px": bounded_error, "lost, share of seeds": lost}
RATIOS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
SVD = {"SVD and PF": "svd_pf", "SVD alone": "svd_pf:use=svd", "PF alone": "svd_pf:use=pf"}

AN = Paper(
    key="an",
    title="An, Gao, Chen, Wu 2007: particle filter with restrained background disturbance",
    remark="With two equally good modes the share of large weight holds both: then the restrained mean is biased too.",
    experiments=(
        Experiment(
            FALSE,
            "A false target beside the true one",
            {f"{label} wide": spec for label, spec in wide().items()}
            | {f"MAP wide, N = {n}": wide(n)["MAP"] for n in (25, 400)}
            | TIGHT
            | {"mean, resampling restrained, wide": f"{wide()['restrained']}:estimate=mean"},
            remark=f"wide: fixed noise of {WIDE_R} px, with which the cloud reaches the false target; the others keep "
            "the adaptive noise, whose cloud is too small to bias the mean.",
            siblings=FALSE.siblings,
            charted=(*(f"{label} wide" for label in ESTIMATES), *TIGHT),
        ),
    ),
    claims=claims(
        FALSE,
        ("The mean over all particles leads to loss.", "section 2", loses("mean wide")),
        ("The mean over particles of large weight keeps the target.", "abstract", holds("restrained wide")),
        (
            "The restrained mean is lost less often than the full one.",
            "abstract",
            less(lost, "restrained wide", "mean wide"),
        ),
        ("The MAP needs many particles.", "section 2", nearer("MAP wide, N = 400", "MAP wide, N = 25")),
        (
            "The restrained mean is nearer to the target than the full one.",
            "section 2",
            nearer("restrained wide", "mean wide"),
        ),
        (
            "The restrained mean is nearer to the target than the MAP.",
            "section 2",
            nearer("restrained wide", "MAP wide"),
        ),
    ),
    untested=(
        Untested("Faces are tracked more accurately.", "abstract", "no frame is available; here are two warm ellipses"),
    ),
    sweeps=(
        Sweep(
            "Error against the false target's likeness, wide cloud",
            "contrast of the false target as a share of the true one's",
            {likeness: (alike(likeness), wide()) for likeness in LIKENESSES},
            SWEPT,
        ),
        Sweep(
            "Error against the number N, wide cloud",
            "N",
            {float(n): (FALSE, wide(n)) for n in COUNTS},
            SWEPT,
        ),
    ),
    switches=switches(
        FALSE,
        *(
            (f"keep by {by}, {keep:g} against all", f"{RESTRAINED}:keep={keep}:keep_by={by}", TIGHT["mean"])
            for by in ("count", "mass")
            for keep in (0.3, 0.6, 0.9)
        ),
        ("two groups of particles (reference 3)", "grey_pf:groups=two", "grey_pf"),
    ),
)

CUI = Paper(
    key="cui",
    title="Cui, Zheng, Li 2011: SVD background suppression and a particle filter",
    remark=(
        "Detection: a frame with status `tracking` and an estimate within 5 px of the target; false alarm: the "
        "same with a larger error."
    ),
    experiments=(Experiment(CLOUD, "A dim target before cloud, its SCR falling", SVD, siblings=CLOUD.siblings),),
    claims=tuple(
        claim
        for scene in (CLOUD, CLOUD.siblings[1])
        for words, figure in (("find the target more often", missed), ("are wrong less often", false_alarms))
        for label in ("SVD alone", "PF alone")
        for claim in claims(
            scene, (f"Both together {words} than {label}.", "abstract", PairedRule(figure, "SVD and PF", label))
        )
    ),
    untested=(
        Untested("Real sequences show the same.", "abstract", "no numbers are available; see the real recordings"),
    ),
    sweeps=(
        Sweep(
            "Detection and false alarms against SCR",
            "signal-to-clutter ratio",
            {ratio: (at_ratio(ratio), SVD) for ratio in RATIOS},
            {"detected, share of frames": detected, "false alarms, share of frames": false_alarms},
        ),
    ),
)

HIDDEN, CROSSED = Scene.of("li-aircraft"), Scene("crossed", "stress/crossing", ("targets.like.path.angle_deg=50",))
CAMSHIFT = Paper(
    key="camshift",
    title="Kalman filter and CamShift: a digest of face tracking",
    remark=(
        "Only a fragment of this paper is available, on faces and colour. The scenes are those of other papers, in "
        "grey levels: an aircraft that is hidden, and two similar persons who cross. The comparison is with mean shift "
        "alone, without prediction."
    ),
    experiments=tuple(
        Experiment(scene, title, {"camshift_kalman": "camshift_kalman", "mean_shift": "mean_shift"})
        for scene, title in ((HIDDEN, "An aircraft hidden"), (CROSSED, "A crossing at 50 degrees"))
    ),
    claims=claims(
        CROSSED,
        ("The tracker keeps its target where another overlaps it.", "introduction", holds("camshift_kalman")),
        (
            "Prediction is decisive where another target overlaps.",
            "introduction",
            nearer("camshift_kalman", "mean_shift"),
        ),
    ),
    untested=(
        Untested(
            "The tracker goes on after an occlusion.",
            "introduction",
            "the paper prints no length of an occlusion; the 11 hidden frames below are those of Li and Li",
        ),
        Untested("Colour and light do not disturb the tracker.", "introduction", "infrared has no colour"),
    ),
)

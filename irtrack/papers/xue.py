"""Experiments of Xue, Yuan, Xie 2011: grey and velocity cues in a cascade of two particle filters."""

from __future__ import annotations

from irtrack.papers.experiment import (
    BETTER,
    Claim,
    Derived,
    Experiment,
    Goal,
    Paper,
    Printed,
    Scene,
    Switch,
    Untested,
    claims,
    switches,
)
from irtrack.papers.rules import (
    abs_x,
    abs_y,
    at_most,
    cpu,
    holds,
    less,
    loses,
    loses_about,
    mostly_nearer,
    nearer,
    on_target,
    unless_lost,
    variance_x,
    variance_y,
)

SKY, GROUND = Scene.of("xue-sky"), Scene.of("xue-ground")
SIZES = {SKY: (30, 15), GROUND: (40, 20)}
"""Numbers of particles N1, N2 of the two layers, by scene."""
MEANS = {SKY: ((0.83, 0.86), (0.43, 0.38)), GROUND: ((1.07, 1.39), (1.25, 1.42))}
PRINTED = {
    SKY: (Printed(*MEANS[SKY], 14.28), Printed((34.3, 2265.87), (3.88, 30.30), 15.69)),
    GROUND: (Printed(*MEANS[GROUND], 21.85), Printed((39.59, 1895.42), (8.9, 41.61), 25.35)),
}
"""Printed results of tables 1 and 2, by scene: of the cascade, and of the paper's reference 8."""
SPEED, RADIUS = 1.2, 10.0
"""Speed of the target in both scenes, px/frame, and radius of the particles' walk, px."""
FOLLOWED = 0.95
"""Share of seeds in which a target must be followed to the end."""


def specs(scene: Scene) -> tuple[str, str, str]:
    """Return the specs of the cascade, the product filter and the mean-shift particle filter, with N = N1 + N2."""
    n1, n2 = SIZES[scene]
    n = n1 + n2
    return f"cascade_pf:n1={n1}:n2={n2}", f"product_pf:particles={n}", f"mean_shift_pf:particles={n}"


def as_many(scene: Scene) -> str:
    """Return the spec of the cascade with as many particles as `by_speed=true` takes at the target's speed."""
    n1, n2 = (round(n * (1 + SPEED / RADIUS) ** 2) for n in SIZES[scene])
    return f"cascade_pf:n1={n1}:n2={n2}"


def experiment(scene: Scene, title: str) -> Experiment:
    cascade, product, shift = specs(scene)
    charted = {
        "cascade_pf": cascade,
        "product_pf": product,
        "mean_shift_pf": shift,
        "mean_shift_pf high-pass": f"{shift}:high_pass=ring",
    }
    others = {
        "no high-pass": f"{cascade}:high_pass=none",
        "full high-pass": f"{cascade}:high_pass=full",
        "frequency high-pass": f"{cascade}:high_pass=butterworth",
        "no velocity": f"{cascade}:cues=grey",
        "grey_pf": "grey_pf",
        "template": "template",
    }
    printed = dict(zip(("cascade_pf", "mean_shift_pf"), PRINTED[scene], strict=True))
    remark = "The number after the paper's ± must be a variance: 2265 px is no standard deviation in a frame of 320 px."
    return Experiment(scene, title, charted | others | BETTER, printed, remark, scene.siblings, (*charted, *BETTER))


def paper_claims(scene: Scene) -> tuple[Claim, ...]:
    (mean_x, var_x), (mean_y, var_y) = MEANS[scene]
    table, chart = ("table 1", "figure 7") if scene is SKY else ("table 2", "figure 9")
    limits = ((abs_x, mean_x), (variance_x, var_x), (abs_y, mean_y), (variance_y, var_y))
    printed = [
        (
            f"The cascade's {figure.words} is as printed.",
            at_most(unless_lost(figure), "cascade_pf", limit, " (conditional: only runs not lost)"),
        )
        for figure, limit in limits
    ]
    return claims(
        scene,
        ("The cascade follows the target stably.", "section 4", holds("cascade_pf")),
        ("Mean shift with a particle filter loses the target.", "section 4", loses("mean_shift_pf")),
        *((text, table, rule) for text, rule in printed),
        (
            "The cascade's error is below that of mean shift with PF.",
            table,
            nearer("cascade_pf", "mean_shift_pf"),
        ),
        ("In most frames the cascade's error is the smaller.", chart, mostly_nearer("cascade_pf", "mean_shift_pf")),
        ("The cascade is faster than mean shift with PF.", table, less(cpu, "cascade_pf", "mean_shift_pf")),
        ("The ring makes the high-pass fast.", "section 1.1", less(cpu, "cascade_pf", "full high-pass")),
        ("High-passes by frequency are slow.", "section 1", less(cpu, "cascade_pf", "frequency high-pass")),
        ("The high-pass reduces noise and clouds.", "section 1", nearer("cascade_pf", "no high-pass")),
        ("The velocity cue helps.", "sections 0, 5", nearer("cascade_pf", "no velocity")),
        ("The cascade is more robust than the product.", "section 3.2", nearer("cascade_pf", "product_pf")),
    )


AT_FRAMES = claims(
    GROUND,
    ("Mean shift with PF fails at the neighbour of frame 83.", "section 4.2", loses_about("mean_shift_pf", 83, 10)),
    ("The cascade passes the neighbour of frame 83.", "section 4.2", on_target("cascade_pf", 84, 128)),
    ("The cascade passes the crossing of frame 129.", "section 4.2", on_target("cascade_pf", 135, 199)),
)


def goals(scene: Scene) -> tuple[Goal, ...]:
    (mean_x, _), (mean_y, _) = MEANS[scene]
    return tuple(
        goal
        for label in ("cascade_pf", *BETTER)
        for goal in (
            Goal("not lost", scene, label, holds(label), FOLLOWED),
            Goal("mean |error| in X of runs not lost (conditional)", scene, label, unless_lost(abs_x), mean_x),
            Goal("mean |error| in Y of runs not lost (conditional)", scene, label, unless_lost(abs_y), mean_y),
        )
    )


def ablations(scene: Scene) -> tuple[Switch, ...]:
    cascade, product, shift = specs(scene)
    return switches(
        scene,
        ("high-pass", cascade, f"{cascade}:high_pass=none"),
        ("fast ring high-pass against the full neighbourhood", cascade, f"{cascade}:high_pass=full"),
        ("fast ring high-pass against high frequencies", cascade, f"{cascade}:high_pass=butterworth"),
        ("number of particles by speed", f"{cascade}:by_speed=true", cascade),
        ("number of particles by speed against the same number always", f"{cascade}:by_speed=true", as_many(scene)),
        ("ring outside the target against the full ring", f"{cascade}:ring_inner=4", cascade),
        ("background on a grid of 2 px against every pixel", f"{cascade}:grid=2", cascade),
        ("velocity cue", cascade, f"{cascade}:cues=grey"),
        ("grey cue", cascade, f"{cascade}:cues=velocity"),
        ("speed by the eigenvalue against its root", cascade, f"{cascade}:velocity=sqrt_lambda"),
        ("velocity by PCA against least squares", cascade, f"{cascade}:velocity=least_squares"),
        ("normal spread against a uniform disc", cascade, f"{cascade}:propagation=disc"),
        ("model update", cascade, f"{cascade}:update=never"),
        ("cascade against product, equal N", cascade, product),
        ("mean shift", shift, f"{cascade}:high_pass=none:cues=grey"),
        ("mean shift on high-pass", f"{shift}:high_pass=ring", shift),
        ("importance correction of moved particles", f"{shift}:corrected=true", shift),
        ("upf: unscented proposal (reference 3) against the motion model", "upf", "upf:proposal=prior"),
        ("upf: carried covariances", "upf:carried=true", "upf"),
        ("upf: grey likelihood against that of the best match", "upf", "upf:weigh=match"),
        ("histogram_moments (reference 9): moments", "histogram_moments", "histogram_moments:cues=histogram"),
        ("histogram_moments: exhaustive search", "histogram_moments", "histogram_moments:reach=0"),
        ("ensemble (reference 11): renewal", "ensemble", "ensemble:renewed=0"),
        ("ensemble: the first frame learned again", "ensemble", "ensemble:anchor=0"),
    )


XUE = Paper(
    key="xue",
    title="Xue, Yuan, Xie 2011: integrating grey and velocity cues",
    remark=(
        "The comparison with mean shift and a particle filter is confounded with the high-pass, which only the "
        "cascade had: that tracker is shown on the high-pass image as well. The number of particles hardly matters to "
        "the time of a step, for the high-pass takes most of it."
    ),
    experiments=(
        experiment(SKY, "First experiment: an aircraft among clouds of similar grey"),
        experiment(GROUND, "Second experiment: a vehicle, a neighbour of similar grey, a crossing"),
    ),
    claims=paper_claims(SKY) + paper_claims(GROUND) + AT_FRAMES,
    derived=(
        Derived(
            "The cascade costs as much as the product of both likelihoods at N = N1 + N2.",
            "section 3.2",
            "not held",
            "with the costs F_g, F_v of a particle's likelihoods the cascade takes N1 F_g + N2 F_v, not the printed "
            "(N1 + N2)(F_g + F_v), which is the product's: it saves N2 F_g + N1 F_v",
        ),
    ),
    untested=(
        Untested("Mean shift with PF drifts at frame 133 of the sky.", "section 4.1", "the frame is not described"),
        Untested(
            "The target's speed can set the number of particles.",
            "section 5",
            "future work, without a method; see the ablation",
        ),
    ),
    goals=goals(SKY) + goals(GROUND),
    switches=ablations(SKY) + ablations(GROUND),
)

"""Xue, Yuan, Xie 2011: grey and velocity cues in a cascade of two particle filters."""

from __future__ import annotations

from irtrack.papers.ours import BETTER
from irtrack.papers.rules import (
    abs_x,
    abs_y,
    as_long,
    at_most,
    cpu,
    error_all,
    holds,
    less,
    loses,
    loses_about,
    mostly_nearer,
    off_share,
    on_target,
    unless_lost,
    variance_x,
    variance_y,
)
from irtrack.papers.values import Claim, Experiment, Goal, Paper, Printed, Scene, Switch, Untested

SKY, GROUND = Scene.of("xue-sky"), Scene.of("xue-ground")
SIZES = {SKY: (30, 15), GROUND: (40, 20)}
PRINTED = {
    SKY: (Printed((0.83, 0.86), (0.43, 0.38), 14.28), Printed((34.3, 2265.87), (3.88, 30.30), 15.69)),
    GROUND: (Printed((1.07, 1.39), (1.25, 1.42), 21.85), Printed((39.59, 1895.42), (8.9, 41.61), 25.35)),
}
"""Tables 1 and 2: the cascade's row, and that of the paper's reference 8."""
GIVEN = " (runs not lost)"
FOLLOWED = 0.95
"""Share of seeds in which a target is to be followed to the end."""


def experiment(scene: Scene, title: str) -> Experiment:
    n1, n2 = SIZES[scene]
    cascade = f"cascade_pf:n1={n1}:n2={n2}"
    own, other = PRINTED[scene]
    return Experiment(
        scene,
        title,
        {
            "cascade_pf": cascade,
            "product_pf": f"product_pf:particles={n1 + n2}",
            "mean_shift_pf": f"mean_shift_pf:particles={n1 + n2}",
            "mean_shift_pf high-pass": f"mean_shift_pf:particles={n1 + n2}:high_pass=ring",
            "no high-pass": f"{cascade}:high_pass=none",
            "full high-pass": f"{cascade}:high_pass=full",
            "no velocity": f"{cascade}:cues=grey",
            "grey_pf": "grey_pf",
            "template": "template",
            **BETTER,
        },
        {"cascade_pf": own, "mean_shift_pf": other},
        "What stands after the paper's ± must be a variance: 2265 px cannot be a deviation in a frame of 320 px.",
        scene.siblings,
        charted=("cascade_pf", "product_pf", "mean_shift_pf", "mean_shift_pf high-pass", *BETTER),
    )


def claims(scene: Scene) -> tuple[Claim, ...]:
    own, _ = PRINTED[scene]
    assert own.abs_x is not None
    assert own.abs_y is not None
    table = "table 1" if scene is SKY else "table 2"
    return (
        Claim("The cascade follows the target stably.", "section 4", scene.name, holds("cascade_pf")),
        Claim("Mean shift with a particle filter loses it.", "section 4", scene.name, loses("mean_shift_pf")),
        *(
            Claim(
                f"The cascade's {words} is the printed one.",
                table,
                scene.name,
                at_most(unless_lost(figure), words, "cascade_pf", limit, GIVEN),
            )
            for words, figure, limit in (
                ("mean |error| in X", abs_x, own.abs_x[0]),
                ("variance in X", variance_x, own.abs_x[1]),
                ("mean |error| in Y", abs_y, own.abs_y[0]),
                ("variance in Y", variance_y, own.abs_y[1]),
            )
        ),
        Claim(
            "The cascade's error is below that of mean shift with a particle filter.",
            table,
            scene.name,
            less(error_all, "mean error", "cascade_pf", "mean_shift_pf"),
        ),
        Claim(
            "In most frames its error is the smaller one.",
            "figure 7" if scene is SKY else "figure 9",
            scene.name,
            mostly_nearer("cascade_pf", "mean_shift_pf"),
        ),
        Claim(
            "The cascade is faster than mean shift with a particle filter.",
            table,
            scene.name,
            less(cpu, "CPU time", "cascade_pf", "mean_shift_pf"),
        ),
        Claim(
            "The ring neighbourhood makes the high-pass fast: the tracker with it is faster than with the full one.",
            "section 1.1",
            scene.name,
            less(cpu, "CPU time", "cascade_pf", "full high-pass"),
        ),
        Claim(
            "The high-pass lessens what noise and clouds do.",
            "section 1",
            scene.name,
            less(off_share, "share of frames off", "cascade_pf", "no high-pass"),
        ),
        Claim(
            "The velocity cue makes it more robust.",
            "sections 0, 5",
            scene.name,
            less(off_share, "share of frames off", "cascade_pf", "no velocity"),
        ),
        Claim(
            "The cascade takes as long as the product of both likelihoods at N = N1 + N2.",
            "section 3.2",
            scene.name,
            as_long("cascade_pf", "product_pf", 0.1),
        ),
        Claim(
            "The cascade is more robust than that product.",
            "section 3.2",
            scene.name,
            less(error_all, "mean error", "cascade_pf", "product_pf"),
        ),
    )


AT_FRAMES = (
    Claim(
        "Mean shift with a particle filter goes wrong at the like-grey neighbour of frame 83.",
        "section 4.2",
        GROUND.name,
        loses_about("mean_shift_pf", 83, 10),
    ),
    Claim("The cascade passes that neighbour.", "section 4.2", GROUND.name, on_target("cascade_pf", 84, 128)),
    Claim("It passes the crossing of frame 129.", "section 4.2", GROUND.name, on_target("cascade_pf", 135, 199)),
)


def goals(scene: Scene) -> tuple[Goal, ...]:
    own, _ = PRINTED[scene]
    assert own.abs_x is not None
    assert own.abs_y is not None
    return tuple(
        goal
        for label in ("cascade_pf", *BETTER)
        for goal in (
            Goal("not lost", scene, label, holds(label), FOLLOWED),
            Goal("mean |error| in X of runs not lost", scene, label, unless_lost(abs_x), own.abs_x[0]),
            Goal("mean |error| in Y of runs not lost", scene, label, unless_lost(abs_y), own.abs_y[0]),
        )
    )


def switches(scene: Scene) -> tuple[Switch, ...]:
    n1, n2 = SIZES[scene]
    cascade, product = f"cascade_pf:n1={n1}:n2={n2}", f"product_pf:particles={n1 + n2}"
    shift = f"mean_shift_pf:particles={n1 + n2}"
    return tuple(
        Switch(mechanism, scene, with_it, without)
        for mechanism, with_it, without in (
            ("high-pass", cascade, f"{cascade}:high_pass=none"),
            ("fast ring high-pass against the full neighbourhood", cascade, f"{cascade}:high_pass=full"),
            ("ring beyond the target against all of it", f"{cascade}:ring_inner=4", cascade),
            ("background on a grid of 2 px against every pixel", f"{cascade}:grid=2", cascade),
            ("velocity cue", cascade, f"{cascade}:cues=grey"),
            ("grey cue", cascade, f"{cascade}:cues=velocity"),
            ("speed by the eigenvalue against its root", cascade, f"{cascade}:velocity=sqrt_lambda"),
            ("velocity by PCA against least squares", cascade, f"{cascade}:velocity=least_squares"),
            ("normal spread against an even disc", cascade, f"{cascade}:propagation=disc"),
            ("model update", cascade, f"{cascade}:update=never"),
            ("cascade against product, equal N and, see the claim above, equal time", cascade, product),
            ("mean shift", shift, f"{cascade}:high_pass=none:cues=grey"),
            ("mean shift on high-pass", f"{shift}:high_pass=ring", shift),
            ("moved particles corrected for the move", f"{shift}:corrected=true", shift),
        )
    )


XUE = Paper(
    key="xue",
    title="Xue, Yuan, Xie 2011: integrating grey and velocity cues",
    remark=(
        "The comparison with mean shift and a particle filter is confounded with the high-pass, which only the "
        "cascade had: that tracker is shown on the high-pass image as well. Cascade and product take about the same "
        "time at N = N1 + N2, for the high-pass is most of it: equal N is equal time as well."
    ),
    experiments=(
        experiment(SKY, "First experiment: an aircraft among clouds of like grey"),
        experiment(GROUND, "Second experiment: a vehicle, a neighbour of like grey, a crossing"),
    ),
    claims=claims(SKY) + claims(GROUND) + AT_FRAMES,
    untested=(
        Untested(
            "Mean shift with a particle filter drifts at frame 133 of the sky.",
            "section 4.1",
            "what is there in that frame of the paper's film is not told; whether it is lost at all is judged above",
        ),
        Untested(
            "High-passes by frequency are slow.", "section 1", "no tracker here has one; the full neighbourhood has"
        ),
        Untested(
            "The target's speed can say how many particles it takes.", "section 5", "named as work to come, without how"
        ),
    ),
    goals=goals(SKY) + goals(GROUND),
    switches=switches(SKY) + switches(GROUND),
)

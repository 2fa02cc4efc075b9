"""Xue, Yuan, Xie 2011: grey and velocity cues in a cascade of two particle filters."""

from __future__ import annotations

from irtrack.sources.rules import abs_x, abs_y, at_most, error_all, holds, less, loses, ms, unless_lost
from irtrack.sources.values import Claim, Experiment, Paper, Printed, Scene, Switch

SKY, GROUND = Scene.of("xue-sky"), Scene.of("xue-ground")
SIZES = {SKY: (30, 15), GROUND: (40, 20)}
PRINTED = {
    SKY: (Printed((0.83, 0.86), (0.43, 0.38), 14.28), Printed((34.3, 2265.87), (3.88, 30.30), 15.69)),
    GROUND: (Printed((1.07, 1.39), (1.25, 1.42), 21.85), Printed((39.59, 1895.42), (8.9, 41.61), 25.35)),
}
"""Tables 1 and 2: the cascade's row, and that of the paper's reference 8."""


def experiment(scene: Scene, title: str) -> Experiment:
    n1, n2 = SIZES[scene]
    own, other = PRINTED[scene]
    return Experiment(
        scene,
        title,
        {
            "cascade_pf": f"cascade_pf:n1={n1}:n2={n2}",
            "product_pf": f"product_pf:particles={n1 + n2}",
            "mean_shift_pf": f"mean_shift_pf:particles={n1 + n2}",
            "mean_shift_pf high-pass": f"mean_shift_pf:particles={n1 + n2}:high_pass=ring",
            "grey_pf": "grey_pf",
            "template": "template",
        },
        {"cascade_pf": own, "mean_shift_pf": other},
        "What stands after the paper's ± must be a variance: 2265 px cannot be a deviation in a frame of 320 px.",
        scene.siblings,
    )


def claims(scene: Scene) -> tuple[Claim, ...]:
    own, _ = PRINTED[scene]
    assert own.abs_x is not None
    assert own.abs_y is not None
    table = "table 1" if scene is SKY else "table 2"
    given = " (runs not lost)"
    return (
        Claim("The cascade follows the target stably.", "section 4", scene.name, holds("cascade_pf")),
        Claim("Mean shift with a particle filter loses it.", "section 4", scene.name, loses("mean_shift_pf")),
        Claim(
            "The cascade's mean |error| in X is the printed one.",
            table,
            scene.name,
            at_most(unless_lost(abs_x), "mean |error| in X", "cascade_pf", own.abs_x[0], given),
        ),
        Claim(
            "The cascade's mean |error| in Y is the printed one.",
            table,
            scene.name,
            at_most(unless_lost(abs_y), "mean |error| in Y", "cascade_pf", own.abs_y[0], given),
        ),
        Claim(
            "The cascade's error is below that of mean shift with a particle filter.",
            table,
            scene.name,
            less(error_all, "mean error", "cascade_pf", "mean_shift_pf"),
        ),
        Claim(
            "The cascade is faster than mean shift with a particle filter.",
            table,
            scene.name,
            less(ms, "time", "cascade_pf", "mean_shift_pf"),
        ),
        Claim(
            "The cascade is more robust than the product of both likelihoods at N = N1 + N2.",
            "section 3.2",
            scene.name,
            less(error_all, "mean error", "cascade_pf", "product_pf"),
        ),
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
            ("velocity cue", cascade, f"{cascade}:cues=grey"),
            ("grey cue", cascade, f"{cascade}:cues=velocity"),
            ("speed by the eigenvalue against its root", cascade, f"{cascade}:velocity=sqrt_lambda"),
            ("velocity by PCA against least squares", cascade, f"{cascade}:velocity=least_squares"),
            ("cascade against product, equal N", cascade, product),
            ("mean shift on high-pass", f"{shift}:high_pass=ring", shift),
            ("moved particles corrected for the move", f"{shift}:corrected=true", shift),
        )
    )


XUE = Paper(
    key="xue",
    title="Xue, Yuan, Xie 2011: integrating grey and velocity cues",
    remark=(
        "The comparison with mean shift and a particle filter is confounded with the high-pass, which only the "
        "cascade had: that tracker is shown on the high-pass image as well. Cascade and product take the same time at "
        "N = N1 + N2, within a twentieth, for the high-pass is most of it: equal N is equal time as well."
    ),
    experiments=(
        experiment(SKY, "First experiment: an aircraft among clouds of like grey"),
        experiment(GROUND, "Second experiment: a vehicle, a neighbour of like grey, a crossing"),
    ),
    claims=claims(SKY) + claims(GROUND),
    switches=switches(SKY) + switches(GROUND),
)

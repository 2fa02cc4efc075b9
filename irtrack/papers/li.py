"""Experiments of Li, Li 2014: fusion of grey and gradient cues, and weight selection."""

from __future__ import annotations

from irtrack.papers.experiment import (
    BETTER,
    Experiment,
    Goal,
    Paper,
    Printed,
    Scene,
    Sweep,
    Untested,
    claims,
    switches,
)
from irtrack.papers.rules import (
    at_most,
    back_in_time,
    cpu,
    error_held,
    holds,
    loses,
    lost,
    nearer,
    on_target,
    score_between,
    times,
)

AIRCRAFT, PEDESTRIAN = Scene.of("li-aircraft"), Scene.of("li-pedestrian")
FRAME_MS = 20
"""Frame period, ms, at the 50 Hz of the paper."""
BACK = 0.95
"""Share of seeds in which a tracker must reacquire the target in time."""
FUSION, STANDARD, SHIFT = "fusion_wspf", "standard PF", "PF and mean shift"
TRACKERS = {
    FUSION: "fusion_wspf",
    STANDARD: "grey_pf:bins=8",
    SHIFT: "mean_shift_pf:particles=100",
    "grey alone": "fusion_wspf:cues=grey",
    "equal shares": "fusion_wspf:confidence=equal",
    "all weights": "fusion_wspf:share=1",
    "always updated": "fusion_wspf:update_when=always",
    "weights reset to 1/N": "fusion_wspf:restoring=equal",
    **BETTER,
}
CHARTED = (FUSION, STANDARD, SHIFT, *BETTER)
MECHANISMS = (
    ("weight selection (Np = .56 N against all)", "fusion_wspf", "fusion_wspf:share=1"),
    ("gradient cue", "fusion_wspf", "fusion_wspf:cues=grey"),
    ("grey cue", "fusion_wspf", "fusion_wspf:cues=gradient"),
    ("confidence against equal shares", "fusion_wspf", "fusion_wspf:confidence=equal"),
    ("confidence by log-ratio against Bhattacharyya", "fusion_wspf", "fusion_wspf:confidence=bhattacharyya"),
    ("confidence by log-ratio against variance ratio", "fusion_wspf", "fusion_wspf:confidence=variance_ratio"),
    ("mean shift in occlusion", "fusion_wspf", "fusion_wspf:widening=0"),
    ("mean shift after 2 frames against 4", "fusion_wspf", "fusion_wspf:shift_after=4"),
    ("re-detection", "fusion_wspf", "fusion_wspf:redetect=false"),
    ("template update", "fusion_wspf", "fusion_wspf:update=0"),
    ("update of a visible target against always", "fusion_wspf", "fusion_wspf:update_when=always"),
    ("rho_T beside the threshold of the scene", "fusion_wspf", "fusion_wspf:rho_t=0"),
    ("particles set aside keep their weights", "fusion_wspf", "fusion_wspf:restoring=equal"),
    ("likelihood_pf (reference 3): regressed weights", "likelihood_pf:regressed=true", "likelihood_pf"),
    ("likelihood_pf: two-stage sampling (reference 4)", "likelihood_pf:sampling=two", "likelihood_pf"),
    ("damping .7 of grey_pf's AR(2) against none", "grey_pf:damping=0.7", "grey_pf"),
)
SLOWER = 48.116217 / 9.671286
"""Ratio of the printed times for 100 frames."""
SHARES = (0.1, 0.2, 0.3, 0.45, 0.56, 0.7, 0.85, 1.0)

LI = Paper(
    key="li",
    title="Li, Li 2014: multi-feature fusion and weight-selected particle filter",
    experiments=tuple(
        Experiment(scene, title, TRACKERS, printed, siblings=scene.siblings, charted=CHARTED)
        for scene, title, printed in (
            (
                AIRCRAFT,
                "First experiment: an aircraft hidden in frames 20 to 30",
                {FUSION: Printed(ms=481.16217), STANDARD: Printed(ms=96.71286)},
            ),
            (PEDESTRIAN, "Second experiment: a pedestrian before complex ground", {}),
        )
    ),
    claims=(
        *claims(
            AIRCRAFT,
            ("The fusion keeps the aircraft through its occlusion.", "section 5.2", holds(FUSION)),
            ("The fusion is back at once after the occlusion.", "section 5.2 (from frame 28 on)", back_in_time(FUSION)),
            ("The fusion passes the flicker of frame 74.", "section 5.2", on_target(FUSION, 74, 80)),
            ("The standard particle filter loses the aircraft.", "figure 4 (a)", loses(STANDARD)),
            ("Particle filter and mean shift lose the aircraft.", "figure 4 (b)", loses(SHIFT)),
            (
                "The coefficient of a hidden target is below .2.",
                "figure 6",
                at_most(score_between(20, 30), FUSION, 0.2),
            ),
            (
                "The fusion takes 48.12 s, the standard filter 9.67 s.",
                "section 5.2",
                times(cpu, FUSION, SLOWER, STANDARD),
            ),
            ("The fusion tracks in real time.", "section 6", at_most(cpu, FUSION, FRAME_MS, " ms (50 Hz)")),
        ),
        *claims(
            PEDESTRIAN,
            ("The fusion follows the pedestrian.", "section 5.2", holds(FUSION)),
            ("The standard particle filter cannot.", "section 5.2", loses(STANDARD)),
            ("The fusion's error is below that of the standard PF.", "section 5.2", nearer(FUSION, STANDARD)),
        ),
        *(
            claim
            for scene in (AIRCRAFT, PEDESTRIAN)
            for claim in claims(
                scene,
                ("The gradient cue helps before clutter.", "section 3.3", nearer(FUSION, "grey alone")),
                ("Shares by confidence help.", "sections 4.1, 6", nearer(FUSION, "equal shares")),
                ("Weight selection helps (Step 6: own weights).", "section 6", nearer(FUSION, "all weights")),
                (
                    "Weight selection helps (Step 6: equal weights).",
                    "section 6",
                    nearer("weights reset to 1/N", "all weights"),
                ),
                ("Updates only at high similarity help.", "section 4.2", nearer(FUSION, "always updated")),
            )
        ),
    ),
    untested=(
        Untested("Neff, RMSE and times of table 1.", "section 5.1", "no numbers available; ours: growth model"),
        Untested("The likelihood particle filter degenerates faster.", "section 1", "no tracker here samples so"),
    ),
    goals=tuple(
        Goal("on the target within 5 frames of its return", AIRCRAFT, label, back_in_time(label), BACK)
        for label in (FUSION, *BETTER)
    ),
    sweeps=tuple(
        Sweep(
            f"Share Np / N of the weights that are selected, {name}",
            "Np / N",
            {share: (scene, {FUSION: f"fusion_wspf:share={share:g}"}) for share in SHARES},
            {"lost, share of seeds": lost, "error before loss, px": error_held},
        )
        for scene, name in ((AIRCRAFT, "aircraft"), (PEDESTRIAN, "pedestrian"))
    ),
    switches=switches(AIRCRAFT, *MECHANISMS) + switches(PEDESTRIAN, *MECHANISMS),
)

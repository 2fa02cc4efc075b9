"""Li, Li 2014: weight selection, and grey and gradient cues fused."""

from __future__ import annotations

from irtrack.papers.ours import BETTER
from irtrack.papers.rules import (
    at_most,
    back_in_time,
    cpu,
    error_all,
    error_held,
    holds,
    less,
    loses,
    lost,
    off_share,
    on_target,
    score_between,
    times,
)
from irtrack.papers.values import Claim, Experiment, Goal, Paper, Printed, Scene, Sweep, Switch, Untested

AIRCRAFT, PEDESTRIAN = Scene.of("li-aircraft"), Scene.of("li-pedestrian")
FRAME_MS = 20
"""Between two frames at the paper's 50 Hz."""
BACK = 0.95
"""Share of seeds in which a tracker is to be back in time."""
TRACKERS = {
    "fusion_wspf": "fusion_wspf",
    "standard PF": "grey_pf:bins=8",
    "PF and mean shift": "mean_shift_pf:particles=100",
    "grey alone": "fusion_wspf:cues=grey",
    "equal shares": "fusion_wspf:confidence=equal",
    "all weights": "fusion_wspf:share=1",
    "always updated": "fusion_wspf:rho_t=0",
    **BETTER,
}
CHARTED = ("fusion_wspf", "standard PF", "PF and mean shift", *BETTER)
MECHANISMS = (
    ("weight selection (Np = .56 N against all)", "fusion_wspf", "fusion_wspf:share=1"),
    ("gradient cue", "fusion_wspf", "fusion_wspf:cues=grey"),
    ("grey cue", "fusion_wspf", "fusion_wspf:cues=gradient"),
    ("confidence against equal shares", "fusion_wspf", "fusion_wspf:confidence=equal"),
    ("confidence by KL", "fusion_wspf:confidence=kullback_leibler", "fusion_wspf"),
    ("confidence by variance ratio", "fusion_wspf:confidence=variance_ratio", "fusion_wspf"),
    ("mean shift in occlusion", "fusion_wspf", "fusion_wspf:widening=0"),
    ("mean shift after 2 frames against 4", "fusion_wspf", "fusion_wspf:shift_after=4"),
    ("re-detection", "fusion_wspf", "fusion_wspf:redetect=false"),
    ("template update", "fusion_wspf", "fusion_wspf:update=0"),
    ("update above rho_T against always", "fusion_wspf", "fusion_wspf:rho_t=0"),
    ("set-aside particles keep their weights", "fusion_wspf", "fusion_wspf:restoring=equal"),
    ("damping .7 of grey_pf's AR(2) against none", "grey_pf:damping=0.7", "grey_pf"),
)
SHARES = (0.1, 0.2, 0.3, 0.45, 0.56, 0.7, 0.85, 1.0)

LI = Paper(
    key="li",
    title="Li, Li 2014: multi-feature fusion and weight-selected particle filter",
    experiments=(
        Experiment(
            AIRCRAFT,
            "First experiment: an aircraft hidden in frames 20 to 30",
            TRACKERS,
            {"fusion_wspf": Printed(ms=481.16217), "standard PF": Printed(ms=96.71286)},
            siblings=AIRCRAFT.siblings,
            charted=CHARTED,
        ),
        Experiment(
            PEDESTRIAN,
            "Second experiment: a pedestrian before complex ground",
            TRACKERS,
            siblings=PEDESTRIAN.siblings,
            charted=CHARTED,
        ),
    ),
    claims=(
        Claim("The fusion keeps the aircraft through its hiding.", "section 5.2", AIRCRAFT.name, holds("fusion_wspf")),
        Claim("It is back at once.", "section 5.2 (from frame 28 on)", AIRCRAFT.name, back_in_time("fusion_wspf")),
        Claim("It passes the flicker of frame 74.", "section 5.2", AIRCRAFT.name, on_target("fusion_wspf", 74, 80)),
        Claim("The standard particle filter loses it.", "figure 4 (a)", AIRCRAFT.name, loses("standard PF")),
        Claim("Particle filter and mean shift lose it.", "figure 4 (b)", AIRCRAFT.name, loses("PF and mean shift")),
        Claim(
            "The matching coefficient falls below .2 while it is hidden.",
            "figure 6",
            AIRCRAFT.name,
            at_most(score_between(20, 30), "median coefficient in frames 20 to 30", "fusion_wspf", 0.2),
        ),
        Claim(
            "It takes five times as long as the standard particle filter (48.12 s against 9.67 s for 100 frames).",
            "section 5.2",
            AIRCRAFT.name,
            times(cpu, "CPU time", "fusion_wspf", 48.116217 / 9.671286, "standard PF"),
        ),
        Claim(
            "It tracks in real time.",
            "section 6",
            AIRCRAFT.name,
            at_most(cpu, "CPU time", "fusion_wspf", FRAME_MS, " ms (50 Hz)"),
        ),
        Claim("The fusion follows the pedestrian.", "section 5.2", PEDESTRIAN.name, holds("fusion_wspf")),
        Claim("The standard particle filter cannot.", "section 5.2", PEDESTRIAN.name, loses("standard PF")),
        Claim(
            "The fusion's error is below that of the standard particle filter.",
            "section 5.2",
            PEDESTRIAN.name,
            less(error_all, "mean error", "fusion_wspf", "standard PF"),
        ),
        *(
            Claim(text, place, scene.name, less(off_share, "share of frames off", "fusion_wspf", other))
            for scene in (AIRCRAFT, PEDESTRIAN)
            for text, place, other in (
                ("The gradient cue bears complex backgrounds.", "section 3.3", "grey alone"),
                ("Shares by confidence are better than equal ones.", "sections 4.1, 6", "equal shares"),
                ("Weight selection makes it track better.", "section 6", "all weights"),
                ("Updating only at high likeness is better than always.", "section 4.2", "always updated"),
            )
        ),
    ),
    untested=(
        Untested(
            "Neff, RMSE and times of table 1.", "section 5.1", "its numbers are lost; the growth model below has ours"
        ),
        Untested(
            "The likelihood particle filter degenerates faster.",
            "section 1",
            "no tracker here draws so",
        ),
    ),
    goals=tuple(
        Goal("on the target within 5 frames of its return", AIRCRAFT, label, back_in_time(label), BACK)
        for label in ("fusion_wspf", *BETTER)
    ),
    sweeps=tuple(
        Sweep(
            f"Share Np / N of the weights that are selected, {words}",
            "Np / N",
            {share: (scene, {"fusion_wspf": f"fusion_wspf:share={share:g}"}) for share in SHARES},
            {"lost, share of seeds": lost, "error before loss, px": error_held},
        )
        for scene, words in ((AIRCRAFT, "aircraft"), (PEDESTRIAN, "pedestrian"))
    ),
    switches=tuple(Switch(name, scene, a, b) for scene in (AIRCRAFT, PEDESTRIAN) for name, a, b in MECHANISMS),
)

"""Li, Li 2014: weight selection, and grey and gradient cues fused."""

from __future__ import annotations

from irtrack.sources.rules import at_most, back_in_time, holds, loses, ms, score_between, times
from irtrack.sources.values import Claim, Experiment, Paper, Printed, Scene, Switch

AIRCRAFT, PEDESTRIAN = Scene.of("li-aircraft"), Scene.of("li-pedestrian")
TRACKERS = {
    "fusion_wspf": "fusion_wspf",
    "standard PF": "grey_pf:bins=8",
    "PF and mean shift": "mean_shift_pf:particles=100",
}
SWITCHES = (
    ("weight selection (Np = .56 N against all)", "fusion_wspf", "fusion_wspf:share=1"),
    ("Np = .3 N against .56 N", "fusion_wspf:share=0.3", "fusion_wspf"),
    ("Np = .8 N against .56 N", "fusion_wspf:share=0.8", "fusion_wspf"),
    ("gradient cue", "fusion_wspf", "fusion_wspf:cues=grey"),
    ("grey cue", "fusion_wspf", "fusion_wspf:cues=gradient"),
    ("confidence against equal shares", "fusion_wspf", "fusion_wspf:confidence=equal"),
    ("confidence by KL", "fusion_wspf:confidence=kullback_leibler", "fusion_wspf"),
    ("confidence by variance ratio", "fusion_wspf:confidence=variance_ratio", "fusion_wspf"),
    ("mean shift in occlusion", "fusion_wspf", "fusion_wspf:widening=0"),
    ("re-detection", "fusion_wspf", "fusion_wspf:redetect=false"),
    ("template update", "fusion_wspf", "fusion_wspf:update=0"),
    ("set-aside particles keep their weights", "fusion_wspf", "fusion_wspf:restoring=equal"),
)

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
        ),
        Experiment(
            PEDESTRIAN, "Second experiment: a pedestrian before complex ground", TRACKERS, siblings=PEDESTRIAN.siblings
        ),
    ),
    claims=(
        Claim("The fusion keeps the aircraft through its hiding.", "section 5.2", AIRCRAFT.name, holds("fusion_wspf")),
        Claim("It is back at once.", "section 5.2 (from frame 28 on)", AIRCRAFT.name, back_in_time("fusion_wspf")),
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
            times(ms, "time", "fusion_wspf", 48.116217 / 9.671286, "standard PF"),
        ),
        Claim("The fusion follows the pedestrian.", "section 5.2", PEDESTRIAN.name, holds("fusion_wspf")),
        Claim("The standard particle filter cannot.", "section 5.2", PEDESTRIAN.name, loses("standard PF")),
    ),
    switches=tuple(Switch(name, scene, a, b) for scene in (AIRCRAFT, PEDESTRIAN) for name, a, b in SWITCHES),
)

"""The hard scenes: ours and the peers, tight and with context, on the same frames; our best against each peer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from irtrack.metrics import Difference, paired_difference
from irtrack.peers import PEERS
from irtrack.sources.runs import Outcome, Wanted
from irtrack.sources.values import Experiment, Scene

CONTEXT = 3
OURS = {
    name: name
    for name in (
        "grey_pf",
        "cascade_pf",
        "product_pf",
        "mean_shift",
        "mean_shift_kalman",
        "mean_shift_pf",
        "background_restrained_pf",
        "fusion_wspf",
        "svd_pf",
        "camshift_kalman",
        "optical_flow",
        "template",
        "kalman",
        "ekf",
    )
} | {"template window": "template:window=20", "kalman ncc": "kalman:measurement=ncc"}
THEIRS = {name: name for name in PEERS} | {f"{name} {CONTEXT}x": f"{name}:context={CONTEXT}" for name in PEERS}
HARD = tuple(
    Experiment(Scene(f"hard-{size}", f"stress/hard-{size}"), f"Targets of {size.replace('x', ' × ')} px", OURS | THEIRS)
    for size in ("14x10", "6x6", "40x28")
)


def wanted_hard() -> Wanted:
    """What the hard scenes need."""
    found = Wanted()
    for experiment in HARD:
        found.add(experiment.scene, experiment.trackers)
    return found


@dataclass(frozen=True)
class Duel:
    """Share of frames lost by the best of ours less that of a peer, on the same seeds."""

    scene: str
    best: str
    peer: str
    own: float
    other: float
    difference: Difference


def duels(outcomes: Mapping[str, Outcome]) -> list[Duel]:
    """Our tracker with the fewest frames off against each peer; a failed run counts as off throughout."""
    found = []
    for experiment in HARD:
        shares = {label: _shares(outcomes[experiment.scene.name], label) for label in experiment.trackers}
        ours = {label: _mean(shares[label]) for label in OURS if shares[label]}
        if not ours:
            continue
        best = min(ours, key=lambda label: ours[label])
        for peer in THEIRS:
            common = sorted(shares[best].keys() & shares[peer].keys())
            own, other = ([shares[label][seed] for seed in common] for label in (best, peer))
            difference = paired_difference(own, other, [str(seed) for seed in common])
            if difference is not None:
                mine, its = sum(own) / len(own), sum(other) / len(other)
                found.append(Duel(experiment.scene.name, best, peer, mine, its, difference))
    return found


def _shares(found: Outcome, label: str) -> dict[int, float]:
    """Share of frames off of each seed."""
    shares = {}
    for seed, run in found.runs.get(label, {}).items():
        if run is None:
            shares[seed] = 1.0
        elif run.score.off_share is not None:
            shares[seed] = run.score.off_share
    return shares


def _mean(shares: Mapping[int, float]) -> float:
    return sum(shares.values()) / len(shares)

"""The hard scenes: ours and the peers, tight and with context, on the same frames; our best against each peer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from irtrack.metrics import FIGURES, Difference, paired_difference
from irtrack.papers.ours import OURS, THEIRS
from irtrack.papers.picks import fewest_off
from irtrack.papers.runs import Outcome, Wanted
from irtrack.papers.values import Experiment, Scene
from irtrack.papers.verdicts import Word

HARD = tuple(
    Experiment(Scene(f"hard-{size}", f"stress/hard-{size}"), f"Targets of {size.replace('x', ' × ')} px", OURS | THEIRS)
    for size in ("14x10", "6x6", "40x28")
)


def wanted_hard(trackers: Mapping[str, str]) -> Wanted:
    """Trackers, by label, on every hard scene."""
    found = Wanted()
    for experiment in HARD:
        found.add(experiment.scene, trackers)
    return found


@dataclass(frozen=True)
class Duel:
    """Share of frames off of the best of ours less that of a peer, on the same seeds."""

    scene: str
    best: str
    peer: str
    own: float
    other: float
    difference: Difference

    @property
    def word(self) -> Word:
        """Whether ours is off in fewer frames."""
        if self.difference.high < 0:
            return "held"
        return "not held" if self.difference.low > 0 else "not decidable"


def duels(outcomes: Mapping[str, Outcome], development: Mapping[str, Outcome]) -> list[Duel]:
    """The one of ours with the fewest frames off on all the scenes, on development seeds, against each peer on each.

    A failed run counts as off throughout.
    """
    names = [experiment.scene.name for experiment in HARD]
    best = fewest_off(OURS, [development[name] for name in names])
    found: list[Duel] = []
    if best is None:
        return found
    for name in names:
        for peer in THEIRS:
            ours, theirs = (outcomes[name].off_shares(label) for label in (best, peer))
            common = sorted(ours.keys() & theirs.keys())
            own, other = ([shares[seed] for seed in common] for shares in (ours, theirs))
            difference = paired_difference(own, other, [str(seed) for seed in common], most=FIGURES["off_share"].most)
            if difference is not None:
                mine, its = sum(own) / len(own), sum(other) / len(other)
                found.append(Duel(name, best, peer, mine, its, difference))
    return found

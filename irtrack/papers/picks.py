"""What is picked is picked on development seeds, so that the seeds it is compared on had no part in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from irtrack.papers.runs import Outcome, Wanted
from irtrack.papers.values import Choice, Paper, Switch


def wanted_choices(papers: Iterable[Paper]) -> Wanted:
    """What the papers' choices need."""
    found = Wanted()
    for paper in papers:
        for rival in paper.rivals:
            for scene in rival.without.scenes:
                found.add(scene, {spec: spec for spec in rival.without.specs})
    return found


def settled(paper: Paper, development: Mapping[str, Outcome]) -> Paper:
    """The paper with a switch in place of each rival, by the outcomes of development seeds."""
    switches = tuple(
        Switch(rival.mechanism, rival.scene, rival.with_it, chosen(rival.without, development))
        for rival in paper.rivals
    )
    return replace(paper, switches=paper.switches + switches, rivals=())


def chosen(choice: Choice, development: Mapping[str, Outcome]) -> str:
    """The spec with the fewest frames off over the scenes; of equal ones the first."""
    picked = fewest_off(choice.specs, [development[scene.name] for scene in choice.scenes])
    return choice.specs[0] if picked is None else picked


def fewest_off(labels: Iterable[str], found: Sequence[Outcome]) -> str | None:
    """The tracker with the smallest mean share of frames off; None where none was run."""
    means = {}
    for label in labels:
        shares = [share for each in found for share in each.off_shares(label).values()]
        if shares:
            means[label] = sum(shares) / len(shares)
    return min(means, key=lambda label: means[label]) if means else None

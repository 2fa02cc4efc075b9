"""Explanation of lost tracks: of one tracker on a scenario, and of the losses in a results file."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import irsim
from irsim.config.base import no_such
from irsim.rng import stream
from irsim.types import Input, Source
from irtrack.bench import Results, RunRecord, SourceRow
from irtrack.errors import InputError, IrtrackError, whole_number
from irtrack.explain.explanation import CauseShare, Explanation, Parting
from irtrack.explain.game import Game, Removed, is_full, subsets
from irtrack.explain.twin_runs import Outcome, Seeds, Task, play
from irtrack.falsify.falsification import Failure, Falsification
from irtrack.metrics.lost import OFF_PX
from irtrack.registry.identity import tracker_name
from irtrack.registry.table import make
from irtrack.replay.replay import named
from irtrack.replay.start import find_start
from irtrack.runner.pool import Runner, start_runner
from irtrack.types import GivenTracker

LEAST_SEEDS = 5
"""Least number of seeds of each twin."""

CHUNK = 8
"""Number of twins that run side by side in one process."""

Progress = Callable[[int, int], None]
"""Called with (twins done, twins to do)."""


def explain_loss(
    source: str | Path | irsim.Scenario | Source,
    tracker: str | GivenTracker,
    *,
    target: str | None = None,
    seed: int | None = None,
    tracker_seed: int | None = None,
    seeds: int = LEAST_SEEDS,
    causes: Sequence[str] | None = None,
    input: Input = "display",
    jobs: int = 1,
    progress: Progress | None = None,
) -> Explanation:
    """Return the causes for which a tracker loses its target, by twins of the scene (`irsim.Twins`).

    source         scenario, or a recording that holds its scenario
    seed           seed of the scene;  tracker_seed  by default that of the scene
    seeds          number of seeds of each twin, 5 or more: of the tracker, or of the noise for one that draws nothing
    causes         names of causes; default: `irsim.Twins`
    jobs           number of worker processes, on which the result does not depend

    InputError for wrong input, such as a recording without a scenario, and where the track is not lost.
    """
    whole_number("seeds", seeds, LEAST_SEEDS)
    scene = scenario_source(source, seed)
    chosen = named(tracker)
    if getattr(chosen, "task", "single") != "single":
        raise InputError(f"{tracker_name(chosen)}: has no single track to lose; allowed: a tracker of one target")
    start = find_start(scene, scene.truths(), target)
    first = scene.arrivals[start.frame]
    task = Task(scene.scenario, str(start.target), first, chosen, input, None if causes is None else tuple(causes))
    own = (scene.seed if tracker_seed is None else tracker_seed) or 0
    with start_runner(whole_number("jobs", jobs, 1), apart=False) as runner:
        return _Explanation(task, own, seeds, runner, progress).run(scene.name)


def explain_failure(falsification: Falsification, failure: Failure, seeds: int = LEAST_SEEDS) -> Explanation:
    """Return the causes for which the tracker of a falsification loses its target in the smallest scene.

    InputError where the failure is no loss of a single track.
    """
    subject = falsification.subject
    scene = irsim.Rendering(falsification.smallest(failure), falsification.name)
    rule = None if isinstance(failure.rule, str) else subject.rules[failure.rule]
    target = None if rule is None else rule.target
    return explain_loss(scene, subject.tracker, target=target, seeds=seeds, input=subject.input)


def scenario_source(source: str | Path | irsim.Scenario | Source, seed: int | None = None) -> irsim.Rendering:
    """Return the scenario of a source; InputError for a recording without one."""
    opened = irsim.open_source(source) if not isinstance(source, irsim.Rendering) else source
    if not isinstance(opened, irsim.Rendering):
        text = opened.scenario_text
        if text is None:
            raise InputError(
                f"{opened.name}: holds no scenario, so it has no twins; allowed: a scenario, or a recording of one"
            )
        opened = irsim.Rendering(irsim.loads(text, f"{opened.name}: scenario", trusted=False), opened.name)
    return opened if seed is None else opened.with_seed(seed)


class _Explanation:
    """Explanation in progress."""

    def __init__(self, task: Task, own: int, seeds: int, runner: Runner, progress: Progress | None) -> None:
        self._task, self._own, self._count, self._runner = task, own, seeds, runner
        self._progress = progress or (lambda done, total: None)
        self._done = 0

    def run(self, scene: str) -> Explanation:
        task, count = self._task, self._count
        twins = irsim.Twins(task.scenario, task.target, task.first, task.causes)
        names, label = tuple(twins.causes), tracker_name(task.tracker)
        wanted = subsets(names)
        total = len(wanted)
        fresh = self._fresh(self._own, "tracker")
        nothing: Removed = frozenset()
        self._progress(0, total)
        (base,) = self._play([nothing], Seeds((self._own, *fresh)))
        lost_at = base.lost_at[0]
        if lost_at is None:
            raise InputError(f"{label} on {scene}, seed {self._own}: the track is not lost; allowed: a lost run")
        if base.draws:
            seeds, lost = Seeds(fresh[:count]), base.lost[1:]
        else:
            noises = self._fresh(task.scenario.seed, "noise")
            (again,) = self._play([nothing], Seeds((self._own,), noises))
            seeds, lost = Seeds((self._own,), noises[:count]), again.lost
        outcomes = {nothing: replace(base, lost_at=base.lost_at[:1])}
        self._progress(1, total)
        outcomes |= self._all(wanted[1:], seeds, total)
        table = {removed: each.lost for removed, each in outcomes.items()} | {nothing: lost[:count]}
        game = Game(names, table, lost[count:])
        pairs = game.pairs_to_try() if not is_full(names) else []
        outcomes |= self._all(pairs, seeds, total + len(pairs))
        game = Game(names, table | {pair: outcomes[pair].lost for pair in pairs}, lost[count:])
        views = {name: outcomes[removed] for name in names if (removed := frozenset([name])) in outcomes}
        shares = tuple(
            CauseShare(
                **asdict(share),
                anchored=twins.causes[share.cause].anchored,
                changes=twins.causes[share.cause].changes,
                path_px=_path_px(base, views[share.cause]),
                hidden=_hidden(base, views[share.cause]),
            )
            for share in game.shares()
        )
        return Explanation(
            tracker=label,
            scene=scene,
            target=task.target,
            seed=self._own,
            lost_at=lost_at,
            first=task.first,
            input=task.input,
            seeds=count,
            seed_kind="tracker" if base.draws else "noise",
            design="all subsets" if is_full(names) else "first and last arrival",
            twins=len(game.lost),
            p_all=game.probability(),
            p_none=game.p_none,
            placebo=game.placebo_restored,
            residual=game.residual,
            shares=shares,
            repairs=tuple(game.repairs()),
            dropped=twins.dropped,
            parting=self._parting(frozenset([shares[0].cause])) if shares else None,
        )

    def _fresh(self, seed: int, kind: str) -> tuple[int, ...]:
        """Return seeds of the twins and as many of the placebo, none of them that of the run."""
        return tuple(int(stream(seed, "explain", kind, k).integers(2**31)) for k in range(2 * self._count))

    def _play(self, removals: Sequence[Removed], seeds: Seeds) -> list[Outcome]:
        return self._runner.call(play, self._task, removals, seeds)

    def _all(self, removals: Sequence[Removed], seeds: Seeds, total: int) -> dict[Removed, Outcome]:
        """Return the outcomes of twins, run in chunks."""
        chunks = [removals[first : first + CHUNK] for first in range(0, len(removals), CHUNK)]
        found: dict[Removed, Outcome] = {}
        for chunk, outcomes in zip(chunks, self._runner.ordered(partial(self._play, seeds=seeds), chunks), strict=True):
            found |= zip(chunk, outcomes, strict=True)
            self._done += len(chunk)
            self._progress(self._done + 1, total)
        return found

    def _parting(self, removed: Removed) -> Parting | None:
        """Return the first frame in which the tracks with and without causes are apart, or else the last of both."""
        scene, twin = (each.tracks[0] for each in self._play([frozenset(), removed], Seeds((self._own,))))
        common = sorted(scene.keys() & twin.keys())
        if not common:
            return None
        apart = (time for time in common if _distance(scene[time][0], twin[time][0]) > OFF_PX)
        time = next(apart, common[-1])
        return Parting(tuple(sorted(removed)), time, (*scene[time], *twin[time]))


def _distance(one: irsim.Box, other: irsim.Box) -> float:
    return math.hypot(one.cx - other.cx, one.cy - other.cy)


def _path_px(base: Outcome, twin: Outcome) -> float:
    """Return the largest distance between the true centres of two twins at the same time, px."""
    common = base.views.keys() & twin.views.keys()
    return max((math.dist(base.views[time][:2], twin.views[time][:2]) for time in common), default=0.0)


def _hidden(base: Outcome, twin: Outcome) -> tuple[int, int]:
    """Return the numbers of frames in which the target is hidden, of those rendered in both twins."""
    common = base.views.keys() & twin.views.keys()
    return sum(base.views[time][2] for time in common), sum(twin.views[time][2] for time in common)


def losses(results: Results, tracker: str | None = None, scene: str | None = None) -> list[RunRecord]:
    """Return the lost runs of one target in a results file, of one tracker (label) or source; InputError for others."""
    cells = [cell for cell in results.cells() if cell.key.task == "single"]
    for what, name, known in (
        ("tracker", tracker, [cell.label for cell in cells]),
        ("scene", scene, [cell.source for cell in cells]),
    ):
        if name is not None and name not in known:
            raise InputError(f"--{what}: {no_such(name, sorted(set(known)))}")
    chosen = [cell for cell in cells if tracker in (None, cell.label) and scene in (None, cell.source)]
    return [cell for cell in chosen if cell.score is not None and cell.score.lost]


def explain_losses(
    results: Results,
    cells: Sequence[RunRecord],
    *,
    seeds: int = LEAST_SEEDS,
    causes: Sequence[str] | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
    failed: Callable[[str], None] = lambda line: None,
) -> Iterator[Explanation]:
    """Yield the explanation of each lost run, stored in the results file; one that the file holds is not repeated.

    failed   called with the reason where a loss cannot be explained
    """
    rows = results.sources()
    for number, cell in enumerate(cells):
        known = results.explanation(cell.key)
        found = None if known is None or causes is not None else Explanation.from_dict(known)
        if found is None or found.seeds < seeds:
            place = f"{cell.label} on {cell.source}, seed {cell.key.tracker_seed}"

            def shown(done: int, total: int, number: int = number) -> None:
                if progress is not None:
                    progress(round(100 * (number + done / total)), 100 * len(cells))

            try:
                found = _of_cell(cell, rows[cell.source, cell.key.source_hash], seeds, causes, jobs, shown)
            except (IrtrackError, irsim.IrsimError) as error:
                failed(f"{place}: {error}")
                continue
            results.add_explanation(cell.key, found.as_dict())
        yield found


def _of_cell(
    cell: RunRecord, row: SourceRow, seeds: int, causes: Sequence[str] | None, jobs: int, progress: Progress
) -> Explanation:
    if cell.key.start != "visible":
        raise InputError("the run starts at a given box; allowed: a run that starts at the truth")
    if row.kind == "recording":
        scene = scenario_source(row.text)
    else:
        scene = irsim.Rendering(irsim.loads(row.text, row.name, trusted=False), row.name)
    name = cell.config["tracker"]
    if ":" in name and name.partition(":")[0] not in sys.modules:  # a results file chooses no code to run
        raise InputError(f"{name}: a results file imports no code; allowed: a scenario with this tracker")
    found = explain_loss(
        scene,
        make(name, cell.config["parameters"]),
        target=cell.key.target,
        tracker_seed=cell.key.tracker_seed,
        seeds=seeds,
        causes=causes,
        input=cell.key.input,
        jobs=jobs,
        progress=progress,
    )
    lost_at = None if cell.score is None else cell.score.lost_at
    if found.lost_at != lost_at:
        raise InputError(f"the loss at frame {lost_at} is now at {found.lost_at}: the tracker or the scene has changed")
    return replace(found, tracker=cell.label, scene=cell.source)

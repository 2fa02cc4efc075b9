"""`irtrack explain`: the causes of lost tracks, by twins of their scenes."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from irsim.cli import terminal
from irtrack.cli.options import AsJson, InputName, Jobs, argument, input_name, names, option
from irtrack.cli.output import print_json, warn_unused
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.explain import Explanation


def explain(
    source: Annotated[str, argument("RUN|DB", "Results file, whose losses are explained; or a scenario or recording.")],
    overrides: Annotated[list[str] | None, argument("KEY=VALUE", "Scenario overrides.")] = None,
    *,
    tracker: Annotated[
        str | None, option("T", "Tracker, NAME[:KEY=VALUE...]; of a results file: a label. Default there: all.")
    ] = None,
    scene: Annotated[str | None, option("S", "Source in a results file; default: all.")] = None,
    target: Annotated[str | None, option("ID", "Target to follow, where the scenario has several.")] = None,
    seed: Annotated[int | None, option("N", "Seed of scene and tracker; default: the scenario's own.", min=0)] = None,
    seeds: Annotated[int, option("N", "Seeds of each twin, 5 or more.")] = 5,
    causes: Annotated[str | None, option("NAME,...", "Causes to remove; default: those of the scenario.")] = None,
    jobs: Jobs = 1,
    input: InputName = "display",
    as_json: AsJson = False,
) -> None:
    """Explain lost tracks: the causes whose removal from the same scene restores them. A results file keeps them."""
    chosen = names("--causes", causes)
    if _is_results(Path(source)):
        _refuse(source, {"KEY=VALUE": overrides, "--target": target, "--seed": seed}, "scenarios")
        found = _explain_results(source, tracker, scene, seeds, chosen, jobs)
    else:
        _refuse(source, {"--scene": scene}, "results files")
        if tracker is None:
            raise InputError("--tracker: is missing; allowed: a tracker of irtrack list that loses the target")
        from irsim import open_source
        from irtrack.bench import parse_tracker_spec
        from irtrack.explain import explain_loss

        opened, spec = open_source(source, overrides or ()), parse_tracker_spec(tracker)
        warn_unused([source], overrides or ())
        with terminal.progress_bar(f"explain {Path(source).stem}") as progress:
            loss = explain_loss(
                opened,
                spec.tracker,
                target=target,
                seed=seed,
                seeds=seeds,
                causes=chosen,
                input=input_name(input),
                jobs=jobs,
                progress=progress,
            )
        found = [loss]
    if as_json:
        print_json([each.as_dict() for each in found])
    else:
        print("\n".join(line for each in found for line in each.lines()))


def _explain_results(
    source: str, tracker: str | None, scene: str | None, seeds: int, causes: list[str] | None, jobs: int
) -> list[Explanation]:
    """Explain the losses in a results file; the reasons of those that cannot be explained go to standard error."""
    from irtrack.bench import Results
    from irtrack.explain import explain_losses
    from irtrack.explain.explain import losses

    reasons: list[str] = []
    with Results(source) as results, terminal.progress_bar(f"explain {Path(source).stem}") as progress:
        cells, failed = losses(results, tracker, scene), reasons.append
        losses_explained = explain_losses(
            results, cells, seeds=seeds, causes=causes, jobs=jobs, progress=progress, failed=failed
        )
        found = list(losses_explained)
    for reason in reasons:
        print(f"irtrack: {reason}", file=sys.stderr)
    if not found:
        raise InputError(f"{source}: no loss is explained; allowed: a results file with lost runs on scenarios")
    return found


def _is_results(path: Path) -> bool:
    """Return whether a file is an SQLite database."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(15) == b"SQLite format 3"


def _refuse(source: str, given: Mapping[str, object], where: str) -> None:
    """Raise InputError for an option that does not belong to the kind of source."""
    for name, value in given.items():
        if value not in (None, []):
            raise InputError(f"{source}: {name} is an option of {where}; allowed here: without it")

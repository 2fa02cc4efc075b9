"""`irtrack check`: properties of a tracker or detector."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irtrack.cli.options import FRAME_LIMIT_S, AsJson, FrameLimit, argument, names, option, path_option
from irtrack.cli.output import print_json, print_table
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.properties import Outcome, Profile


def check(
    tracker: Annotated[
        str, argument("NAME[:KEY=VALUE...]", "Tracker or detector of `irtrack list`, or module:Class; parameters.")
    ],
    profile: Annotated[str, option("ci|nightly", "Effort: ci takes seconds, nightly minutes.")] = "ci",
    only: Annotated[str | None, option("NAME,...", "Only these properties, and broken ones that they need.")] = None,
    time_limit: FrameLimit = FRAME_LIMIT_S,
    output: Annotated[
        Path | None, path_option("DIR", "Folder for the scenes of the failing examples, NAME.yaml.", "-o", "--output")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Test the properties that every tracker or detector should have; print verdicts and smallest failing examples."""
    from irsim.recording.output import check_output, make_folder

    effort, wanted = _profile(profile), names("--only", only)
    from irtrack.bench.plan import task_of
    from irtrack.bench.spec import read_spec
    from irtrack.properties import PROPERTIES_OF
    from irtrack.properties import check as checked
    from irtrack.registry.table import runnable

    spec = read_spec(tracker)
    made = runnable(spec.name, spec.parameters)
    if output is not None:
        make_folder(output)
        for name in PROPERTIES_OF[task_of(made)]:
            check_output(output / f"{name}.yaml")
    with terminal.progress_bar(tracker) as progress:
        outcomes = checked(made, profile=effort, only=wanted, frame_limit_s=time_limit, progress=progress)
    repeat = _repeated(tracker, profile, time_limit)
    broken = [outcome for outcome in outcomes if outcome.verdict == "broken"]
    if as_json:
        rows = [_row(outcome, repeat) for outcome in outcomes]
        print_json({"tracker": tracker, "profile": profile, "holds": not broken, "properties": rows})
    else:
        _print(outcomes, repeat)
    for path in _write(outcomes, output):
        if not as_json:
            print(f"wrote {path}")
    if broken:
        raise typer.Exit(1)


def _profile(word: str) -> Profile:
    if word == "ci":
        return "ci"
    if word == "nightly":
        return "nightly"
    raise InputError(f"--profile {word}: allowed: ci or nightly")


def _repeated(tracker: str, profile: str, time_limit: float) -> Callable[[Outcome], str]:
    """Return a function that returns, for an outcome, the command that tests its property again."""
    further = [] if profile == "ci" else ["--profile", profile]
    further += [] if time_limit == FRAME_LIMIT_S else ["--time-limit", f"{time_limit:g}"]
    return lambda outcome: shlex.join(["irtrack", "check", tracker, "--only", outcome.property.name, *further])


def _row(outcome: Outcome, repeat: Callable[[Outcome], str]) -> dict[str, Any]:
    return {
        "property": outcome.property.name,
        "says": outcome.property.says,
        "verdict": outcome.verdict,
        "why": outcome.why,
        "drawn": {
            name: value if isinstance(value, int | float | list) else str(value)
            for name, value in outcome.drawn.items()
        },
        "scenario": outcome.scenario,
        "repeat": repeat(outcome),
    }


def _print(outcomes: Sequence[Outcome], repeat: Callable[[Outcome], str]) -> None:
    """Print the table, then each broken property with its smallest failing example and the command that repeats it."""
    rows = [
        (each.property.name, each.verdict, each.property.says if each.verdict in ("holds", "broken") else each.why)
        for each in outcomes
    ]
    print_table(("property", "verdict", "statement, or reason"), rows, left=3)
    for each in outcomes:
        if each.verdict == "broken":
            drawn = ", ".join(f"{name} {value}" for name, value in each.drawn.items())
            print(f"\n{each.property.name}: {each.why}")
            if drawn:
                print(f"  smallest example: {drawn}")
            if each.scenario is not None:
                print(f"  scene: {_scene(each.scenario)}")
            print(f"  repeat: {repeat(each)}")
    counts = [(verdict, sum(each.verdict == verdict for each in outcomes)) for verdict in _VERDICTS]
    print("\n" + ", ".join(f"{count} {verdict}" for verdict, count in counts if count))


_VERDICTS = ("holds", "broken", "excused", "not asked", "not judged")


def _scene(text: str) -> str:
    """Return the parameters of a scene in one line."""
    import irsim

    scenario = irsim.loads(text)
    path: Any = scenario.targets[0].path
    values = [f"{key} {getattr(path, key):g}" for key in ("speed", "heading_deg") if hasattr(path, key)]
    return ", ".join([*values, f"NETD {scenario.camera.netd_mk:g} mK", f"seed {scenario.seed}"])


def _write(outcomes: Sequence[Outcome], folder: Path | None) -> Iterator[Path]:
    """Write the scenes of the smallest failing examples into a folder; yield each path."""
    from irsim.recording.output import atomic_text

    if folder is None:
        return
    for outcome in outcomes:
        if outcome.verdict == "broken" and outcome.scenario is not None:
            path = folder / f"{outcome.property.name}.yaml"
            with atomic_text(path) as file:
                file.write(outcome.scenario)
            yield path

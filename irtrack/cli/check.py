"""The command `irtrack check`."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.cli.terminal import given_path
from irtrack.cli.options import FRAME_LIMIT_S, AsJson, FrameLimit, names
from irtrack.cli.output import print_json, print_table
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.properties import Outcome, Profile


def check(
    tracker: Annotated[
        str,
        typer.Argument(metavar="NAME[:KEY=VALUE...]", help="A name from `irtrack list`, or module:Class; parameters."),
    ],
    profile: Annotated[
        str, typer.Option(metavar="ci|nightly", help="How much is tried: ci in seconds, nightly in minutes.")
    ] = "ci",
    only: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="These alone, and of what they need what is broken.")
    ] = None,
    time_limit: FrameLimit = FRAME_LIMIT_S,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Write the scene of each least example, NAME.yaml, there.",
            parser=given_path,
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Try the properties that any tracker should have; print which hold, and the least example that breaks one."""
    from irsim.recording.output import check_output, make_folder

    effort, wanted = _profile(profile), names("--only", only)
    from irtrack.bench import parse_tracker_spec
    from irtrack.properties import PROPERTIES
    from irtrack.properties import check as checked

    made = parse_tracker_spec(tracker).tracker
    if output is not None:
        make_folder(output)
        for name in PROPERTIES:
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
    """The command that tries a property again."""
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
    """The table; below it each broken property with its least example and how to repeat it."""
    rows = [
        (each.property.name, each.verdict, each.property.says if each.verdict in ("holds", "broken") else each.why)
        for each in outcomes
    ]
    print_table(("property", "verdict", "what holds, or why it is not held to it"), rows, left=3)
    for each in outcomes:
        if each.verdict == "broken":
            drawn = ", ".join(f"{name} {value}" for name, value in each.drawn.items())
            print(f"\n{each.property.name}: {each.why}")
            if drawn:
                print(f"  least example: {drawn}")
            if each.scenario is not None:
                print(f"  scene: {_scene(each.scenario)}")
            print(f"  repeat it: {repeat(each)}")
    counts = [(verdict, sum(each.verdict == verdict for each in outcomes)) for verdict in _VERDICTS]
    print("\n" + ", ".join(f"{count} {verdict}" for verdict, count in counts if count))


_VERDICTS = ("holds", "broken", "excused", "not asked", "not judged")


def _scene(text: str) -> str:
    """What differs from scene to scene, in one line."""
    import irsim

    scenario = irsim.loads(text)
    path = scenario.targets[0].path
    told = [f"{key} {getattr(path, key):g}" for key in ("speed", "heading_deg") if hasattr(path, key)]
    return ", ".join([*told, f"NETD {scenario.camera.netd_mk:g} mK", f"seed {scenario.seed}"])


def _write(outcomes: Sequence[Outcome], folder: Path | None) -> Iterator[Path]:
    """The scenes of the least examples, as files in a folder that is there; each when it is written."""
    from irsim.recording.output import atomic_text

    if folder is None:
        return
    for outcome in outcomes:
        if outcome.verdict == "broken" and outcome.scenario is not None:
            path = folder / f"{outcome.property.name}.yaml"
            with atomic_text(path) as file:
                file.write(outcome.scenario)
            yield path

"""Parsing of command-line arguments."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from command_line import Run

from irsim.cli.app import app as irsim_app
from irsim.cli.terminal import OPTIONS, in_options
from irsim.types import Box
from irtrack import InputError
from irtrack.cli import app as irtrack_app
from irtrack.cli.options import parameters, split_settings, start_box
from irtrack.registry.table import find

ROOT = Path(__file__).parents[2]


def test_start_box_is_parsed_as_in_label_files() -> None:
    assert start_box("10,20,5,4") == (Box(12.0, 21.5, 5.0, 4.0), 0)
    assert start_box("-1.5,0,4,4@7") == (Box(0.0, 1.5, 4.0, 4.0), 7)
    for wrong in ("", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,-4", "nan,2,3,4", "1,2,3,4@", "1,2,3,4@-1", "1,2,3,4@x"):
        with pytest.raises(InputError, match=r"--init .*allowed"):
            start_box(wrong)


def test_settings_are_divided() -> None:
    scenario = ["seed", "frames", "camera"]
    words = ["particles=1e3", "frames=5", "camera.netd_mk=80", "noise=fixed", "targets.jet.path.speed=3"]
    split = split_settings(words, find("grey_pf"), scenario)
    assert split.tracker == {"particles": 1000.0, "noise": "fixed"}
    assert split.scenario == ("frames=5", "camera.netd_mk=80", "targets.jet.path.speed=3")
    with pytest.raises(InputError, match="did you mean 'frames'"):
        split_settings(["frame=3"], find("grey_pf"), scenario)


def test_tracker_that_accepts_any_setting() -> None:
    class Any:
        def __init__(self, frames: int = 0, **others: object) -> None: ...

    assert parameters(Any) == (["frames"], True)
    split = split_settings(["frames=5", "depth=2", "camera.bits=8"], Any, ["frames"])
    assert split.tracker == {"frames": 5, "depth": 2}
    assert split.scenario == ("camera.bits=8",)


@pytest.mark.parametrize("name", ["irsim", "irtrack"])
def test_docs_name_every_command_and_option(name: str) -> None:
    app = {"irsim": irsim_app, "irtrack": irtrack_app}[name]
    rows = (Path(__file__).parents[2] / "docs" / "commands.md").read_text().splitlines()
    missing = []
    for command, found in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]  # it is a group of commands
        row = next((row for row in rows if row.startswith((f"| `{name} {command} ", f"| `{name} {command}`"))), None)
        if row is None:
            missing.append(command)
            continue
        options = [max(each.opts, key=len) for each in found.params if each.param_type_name == "option"]
        missing += [f"{command} {option}" for option in options if option != "--help" and not _named(option, row)]
    assert missing == []


def _named(option: str, row: str) -> bool:
    short = {"--output": "-o"}
    return option in row or short.get(option, option) in row


COMMAND_LINE = {"irsim/frame_range.py", "irtrack/bench/baseline.py"}
"""Modules outside `cli` whose errors name options, as only commands call them."""


def test_library_errors_name_arguments_not_options() -> None:
    looked, found = 0, []
    for path in sorted([*ROOT.glob("irsim/**/*.py"), *ROOT.glob("irtrack/**/*.py")]):
        name = path.relative_to(ROOT).as_posix()
        if "import typer" in path.read_text() or name.startswith("irtrack/cli/") or name in COMMAND_LINE:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Raise):
                looked += 1
                texts = [each.value for each in ast.walk(node) if isinstance(each, ast.Constant)]
                found += [(name, text) for text in texts if isinstance(text, str) and re.search(r"--[a-z]", text)]
    assert looked > 300
    assert not found


@pytest.mark.parametrize("parameter", OPTIONS)
def test_argument_names_become_option_names(parameter: str) -> None:
    """Each is an option in the reference of commands."""
    option = in_options(f"give it ({parameter})").removeprefix("give it (").removesuffix(")")
    assert option.split()[0].removeprefix("--") in re.findall(r"--([a-z]+)", (ROOT / "docs/commands.md").read_text())
    assert in_options("import my_kinds first, if you trust it").startswith("--import my_kinds before the command")


@pytest.mark.parametrize(
    "line",
    [
        "there is no stop=None.mcap",
        "a.png: there is no ./init=BOXES",
        "nonstop=N is no key; allowed: frames",
        "of region=X,Y,W,H.mcap nothing is left",
        "there is no 'truth=CSV'; allowed: a file",
        "stop=N: there is no key 'stop'; allowed: frames",
        "camera.rate_hz=HZ is no number",
    ],
)
def test_user_text_stays_unchanged(line: str) -> None:
    assert in_options(line) == line


def test_parameter_at_the_end_of_a_sentence() -> None:
    assert in_options("no truth; give it by init=BOX.") == "no truth; give it by --init X,Y,W,H[@FRAME]."


def test_file_named_like_a_parameter_keeps_its_name(tmp_path: Path, run: Run) -> None:
    assert "--frames" not in run("info", "stop=None.mcap", cwd=tmp_path).stderr


SWALLOWS = """\
import os, signal, time
import typer
from irsim.cli.terminal import run

signal.signal(signal.SIGNAL, signal.SIG_DFL)  # nohup ignores one, a shell's background another
app = typer.Typer()

@app.command()
def work() -> None:
    try:
        os.kill(os.getpid(), signal.SIGNAL)
        time.sleep(60)
    except KeyboardInterrupt:
        raise TypeError("Cannot compare structured arrays") from None

run(app, "work")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_interrupt_inside_a_library_call(name: str, status: int) -> None:
    """numpy raises TypeError from an interrupt in a comparison of structured arrays."""
    program = SWALLOWS.replace("SIGNAL", name)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (status, "work: stopped\n")

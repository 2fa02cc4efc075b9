"""Arguments of the command line: their meaning."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from irsim.cli import terminal
from irsim.cli.app import app as irsim_app
from irsim.types import Box
from irtrack import InputError
from irtrack.cli import app as irtrack_app
from irtrack.cli.options import parameters, split_settings, start_box
from irtrack.external import HINT
from irtrack.registry.table import find

ROOT = Path(__file__).parents[2]


def test_a_start_box_is_read_as_label_files_write_it() -> None:
    assert start_box("10,20,5,4") == (Box(12.0, 21.5, 5.0, 4.0), 0)
    assert start_box("-1.5,0,4,4@7") == (Box(0.0, 1.5, 4.0, 4.0), 7)
    for wrong in ("", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,-4", "nan,2,3,4", "1,2,3,4@", "1,2,3,4@-1", "1,2,3,4@x"):
        with pytest.raises(InputError, match=r"--init .*allowed"):
            start_box(wrong)


def test_settings_go_to_whom_they_are_for() -> None:
    scenario = ["seed", "frames", "camera"]
    words = ["particles=1e3", "frames=5", "camera.netd_mk=80", "noise=fixed", "targets.jet.path.speed=3"]
    split = split_settings(words, find("grey_pf"), scenario)
    assert split.tracker == {"particles": 1000.0, "noise": "fixed"}
    assert split.scenario == ("frames=5", "camera.netd_mk=80", "targets.jet.path.speed=3")
    with pytest.raises(InputError, match="did you mean 'frames'"):
        split_settings(["frame=3"], find("grey_pf"), scenario)


def test_a_foreign_tracker_may_take_any_setting_and_its_own_come_first() -> None:
    class Any:
        def __init__(self, frames: int = 0, **others: object) -> None: ...

    assert parameters(Any) == (["frames"], True)
    split = split_settings(["frames=5", "depth=2", "camera.bits=8"], Any, ["frames"])
    assert split.tracker == {"frames": 5, "depth": 2}
    assert split.scenario == ("camera.bits=8",)


@pytest.mark.parametrize("name", ["irsim", "irtrack"])
def test_page_of_commands_has_an_example_of_each(name: str) -> None:
    app = {"irsim": irsim_app, "irtrack": irtrack_app}[name]
    page = (Path(__file__).parents[2] / "docs" / "commands.md").read_text()
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]  # it is a group of commands
    assert [command for command in commands if not re.search(rf"^\| .* \| `{name} {command}[ `]", page, re.M)] == []


COMMAND_LINE = {"irsim/errors.py", "irtrack/bench/baseline.py"}
"""Modules besides those of the commands whose errors speak of options: only the command line comes there."""


def test_errors_of_the_library_name_arguments_not_options() -> None:
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
@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_an_interrupt_that_a_library_takes_for_an_error_is_none(name: str, status: int) -> None:
    """As numpy does while it compares structured arrays."""
    program = SWALLOWS.replace("SIGNAL", name)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (status, "work: stopped\n")


def test_a_long_error_is_cut(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    app = typer.Typer()

    @app.command()
    def fail() -> None:
        raise InputError("x" * 100_000)

    monkeypatch.setattr(sys, "argv", ["irsim"])
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(terminal, "_interrupt_on_signals", list)  # pytest keeps its own
    with pytest.raises(SystemExit) as left:
        terminal.run(app, "irsim")
    assert left.value.code == 2
    assert capsys.readouterr().err.endswith(f"{'x' * 50}... (100000 characters)\n")


@pytest.mark.parametrize("app", [irsim_app, irtrack_app])
def test_help_is_not_cut(app: typer.Typer) -> None:
    """Defect 12: descriptions of commands ended with an ellipsis."""
    text = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "80", "TERMINAL_WIDTH": "80"}).output
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]  # it is a group of commands
    assert all(re.search(rf"^  {name} ", text, re.M) for name in commands)
    cut = [line for line in text.splitlines() if re.search(r"(…|\.\.\.)$", line) and "[ARGS]" not in line]
    assert cut == []


def test_hint_on_peers_names_an_environment_first() -> None:
    """Defect 13: users of pip were told of a Makefile that they do not have."""
    assert HINT.startswith("IRTRACK_PEERS=PYTHON names the Python")
    assert "in a checkout `make peers`" in HINT

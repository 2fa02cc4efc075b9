"""An empty word where a path belongs, some variable of a script that is not set, is refused by every command."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import typer
from typer.testing import CliRunner

from irsim.cli.app import app as irsim_app
from irsim.cli.terminal import UsageError, given_path, usage_line
from irtrack.cli.app import app as irtrack_app


def paths() -> list[tuple[typer.Typer, str, str, Any]]:
    """Every option and argument of every command that is a path: the app, the command, its key, what typer has."""
    found = []
    for app in (irsim_app, irtrack_app):
        for command in app.registered_commands:
            assert command.callback is not None
            for key, hint in get_type_hints(command.callback, include_extras=True).items():
                kind, *told = get_args(hint) or (hint,)
                if Path in (kind, *get_args(kind)):
                    name = command.name or command.callback.__name__
                    found.append((app, name, key, told[0] if told else None))
    return found


@pytest.mark.parametrize(
    ("app", "command", "key", "told"), paths(), ids=lambda each: each if isinstance(each, str) else ""
)
def test_an_empty_path_is_refused(app: typer.Typer, command: str, key: str, told: Any) -> None:
    assert told.parser is given_path, f"{command}: {key}"


def test_there_are_such_options() -> None:
    """Or the test before this tries nothing."""
    commands = {(command, key) for _, command, key, _ in paths()}
    assert {("masks", "output"), ("render", "output"), ("run", "csv"), ("compare", "junit_file")} <= commands


@pytest.mark.parametrize(
    "words",
    [
        ["masks", "sky", "-o", ""],
        ["sample", "ranges", "--output="],
        ["new", "sky", "-o", ""],
    ],
)
def test_nothing_is_written(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    command = typer.main.get_command(irsim_app)
    with pytest.raises(UsageError) as caught:
        command(words, standalone_mode=False)
    assert usage_line(caught.value) == "--output: is empty; allowed: the name of a file or folder"
    assert list(tmp_path.iterdir()) == []


def test_the_current_folder_may_be_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(irsim_app, ["masks", "sky", "frames=1", "-o", "."])
    assert done.exit_code == 0, done.output
    assert list(tmp_path.glob("000000_*_whole.png"))

"""An empty path, such as of an unset variable in a script, is refused by every command."""

from __future__ import annotations

from pathlib import Path
from typing import get_args, get_type_hints

import pytest
import typer
from typer.testing import CliRunner

from irsim.cli.app import app as irsim_app
from irsim.cli.terminal import UsageError, given_path, usage_line
from irtrack.cli.app import app as irtrack_app


def test_each_option_that_is_a_path_refuses_an_empty_one() -> None:
    found = set()
    for app in (irsim_app, irtrack_app):
        for command in app.registered_commands:
            assert command.callback is not None
            for key, hint in get_type_hints(command.callback, include_extras=True).items():
                kind, *options = get_args(hint) or (hint,)
                if Path in (kind, *get_args(kind)):
                    name = command.name or command.callback.__name__
                    found.add((name, key))
                    assert options, f"{name}: {key}"
                    assert options[0].parser is given_path, f"{name}: {key}"
    assert {("masks", "output"), ("render", "output"), ("run", "csv"), ("compare", "junit_file")} <= found


@pytest.mark.parametrize("words", [["masks", "sky", "-o", ""], ["sample", "ranges", "--output="]])
def test_nothing_is_written(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError) as caught:
        typer.main.get_command(irsim_app)(words, standalone_mode=False)
    assert usage_line(caught.value) == "--output: is empty; allowed: the name of a file or folder"
    assert list(tmp_path.iterdir()) == []


def test_current_folder_is_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(irsim_app, ["masks", "sky", "frames=1", "-o", "."])
    assert done.exit_code == 0, done.output
    assert list(tmp_path.glob("000000_*_whole.png"))

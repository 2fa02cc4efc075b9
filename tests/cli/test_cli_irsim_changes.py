"""Overrides, seed and --without of the commands that take a scenario."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import SMALL_SCENE, Run

import irsim

COMMANDS = {
    "check": [],
    "info": [],
    "noise": ["--region", "0,0,72,64", "--json"],
    "fit": ["--region", "0,0,72,64"],
    "realism": ["--json"],
    "show": ["-o", "sheet.png"],
    "render": ["-o", "scene.mcap"],
    "masks": ["-o", "masks"],
}
"""Commands that take a scenario, with options by which their output depends on it."""

SHAKEN = SMALL_SCENE.replace("frames: 6", "frames: 24").replace(
    "{size: [48, 32]", "{size: [72, 64], motion: [{kind: jitter}]"
)


@pytest.mark.parametrize("command", ["check", "noise", "render"])
def test_overrides_equal_changes_of_the_scenario(run: Run, tmp_path: Path, command: str) -> None:
    """--without adds to the parts that the scenario switches off."""
    changed = SHAKEN.replace("seed: 3", "seed: 4").replace("speed: 2", "speed: 1")
    (tmp_path / "text").mkdir()
    (tmp_path / "words").mkdir()
    (tmp_path / "text" / "scene.yaml").write_text(changed + "without: [jitter, white]\n")
    (tmp_path / "words" / "scene.yaml").write_text(SHAKEN + "without: [jitter]\n")
    seed = ["seed=4"] if command == "check" else ["--seed", "4"]
    words = [*seed, "targets.jet.path.speed=1", "--without", "white"]
    by_text, by_words = output_of(run, tmp_path / "text", command), output_of(run, tmp_path / "words", command, *words)
    assert by_text == by_words
    if command != "check":
        assert output_of(run, tmp_path / "words", command) != by_words


def output_of(run: Run, folder: Path, command: str, *words: str) -> object:
    """Return the output of a command, and the pictures that it writes."""
    done = run(command, "scene.yaml", *COMMANDS[command], *words, cwd=folder)
    assert done.returncode == 0, done.stderr
    if command == "render":
        return [frame.image.tobytes() for frame in irsim.open_recording(folder / "scene.mcap").frames()]
    return done.stdout, {path.name: path.read_bytes() for path in folder.rglob("*.png")}


@pytest.mark.parametrize("command", ["check", "render"])
def test_overrides_without_effect_are_warned_of(run: Run, tmp_path: Path, command: str) -> None:
    """Except for the scenario's hash, the output does not change."""
    vary = "vary: {targets.jet.path.speed: {kind: uniform, low: 1, high: 3}}\n"
    (tmp_path / "scene.yaml").write_text(SHAKEN.replace("noise: [{kind: white}]", "detector: {kind: electrons}") + vary)
    words = COMMANDS.get(command, ["-n", "1"])
    plain, idle = (run(command, "scene.yaml", *words, *more, cwd=tmp_path) for more in ([], ["camera.netd_mk=3000"]))
    assert idle.returncode == 0, idle.stderr
    warning = "override camera.netd_mk: warning: does not count for a detector of kind electrons: its own keys decide"
    assert [line for line in idle.stderr.splitlines() if "warning: does not count" in line] == [warning]
    said, without = (
        [line for line in done.stdout.splitlines() if not line.startswith("scene hash ")] for done in (idle, plain)
    )
    assert said == without


def test_unknown_part_to_switch_off(run: Run, folder: Path) -> None:
    for command, extra in COMMANDS.items():
        done = run(command, "scene.yaml", "--without", "nobody", *extra, cwd=folder)
        assert done.returncode == 2
        assert "override without: without.0: there is no 'nobody'; allowed: jet, white" in done.stderr


def test_check_names_the_wrong_scenario(run: Run, folder: Path) -> None:
    (folder / "other.yaml").write_text(SMALL_SCENE.replace("jet", "plane"))
    done = run("check", "scene.yaml", "other.yaml", "--without", "jet", cwd=folder)
    assert done.returncode == 2
    assert done.stdout == "scene.yaml: ok\n"
    assert done.stderr.startswith("other.yaml: override without: without.0: there is no 'jet'; allowed: plane, white")

"""Fixtures that several test files share."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from command_line import Done, Run
from hypothesis import HealthCheck, settings

from irsim.cli import main

# No test is timed: on a busy machine drawing is slow, and nothing is wrong.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Workers that run tests side by side must collect the same names: an address in one differs in each."""
    if bad := [item.nodeid for item in items if " at 0x" in item.nodeid]:
        raise pytest.UsageError(f"a test's name holds an address: give its parameters ids: {bad[0]}")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """The command irsim in this process: `run("check", "sky", cwd=folder)`."""

    def call(*arguments: str, cwd: Path) -> Done:
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["irsim", *arguments])
        monkeypatch.setattr(sys, "path", list(sys.path))
        with pytest.raises(SystemExit) as caught:
            main()
        captured = capsys.readouterr()
        return Done(int(caught.value.code or 0), captured.out, captured.err)

    return call

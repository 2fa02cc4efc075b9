"""Full disks: an error of one line, and no partial file."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import planted_failure
import pytest

import irsim
from irtrack.bench import Results
from irtrack.errors import InputError
from irtrack.falsify import find_failure
from irtrack.falsify.outputs import FOUND, JOURNAL
from irtrack.falsify.regressions import keep
from irtrack.falsify.rules import rules_of
from irtrack.falsify.trial import Subject
from irtrack.report.finding import write_failure_report

SCENE = planted_failure.SCENE.replace("low: 4, high: 54", "low: 32, high: 36")
"""Half of it breaks the tracker."""


@contextmanager
def disk_full(left: int = 50) -> Iterator[None]:
    """No file may grow beyond so many bytes, as if there were no room for more."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (left, limit[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)


def hunt(folder: Path) -> None:
    find_failure(
        irsim.loads(SCENE), "planted_failure:Raising", folder, name="blind", fresh=5, report=write_failure_report
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what a hunt leaves."""
    folder = tmp_path_factory.mktemp("whole")
    hunt(folder)
    return folder


@pytest.mark.slow
def test_a_failure_is_written_whole_or_not_at_all(whole: Path, tmp_path: Path) -> None:
    """The search is over by then; with room again only the files are written."""
    (tmp_path / JOURNAL).write_bytes((whole / JOURNAL).read_bytes())
    room = (whole / "minimal.mcap").stat().st_size
    with disk_full(room), pytest.raises(InputError, match=r"minimal\.db: cannot use the results file"):
        hunt(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {JOURNAL}
    hunt(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {JOURNAL, *FOUND}
    assert (tmp_path / JOURNAL).read_bytes() == (whole / JOURNAL).read_bytes()


def test_a_failure_is_kept_whole_or_not_at_all(whole: Path, tmp_path: Path) -> None:
    subject = Subject("raising", planted_failure.Raising(), "display", rules_of(irsim.loads(SCENE)))

    def kept() -> set[str]:
        return {path.suffix for path in tmp_path.iterdir()}

    for room in (50, (whole / "minimal.mcap").stat().st_size - 1):
        with disk_full(room), pytest.raises(InputError, match="File too large"):
            keep(whole, subject, "blind", "raises", tmp_path)
        assert not kept()
    keep(whole, subject, "blind", "raises", tmp_path)
    with disk_full(), pytest.raises(InputError, match="File too large"):
        keep(whole, subject, "blind", "raises", tmp_path)
    assert kept() == {".yaml", ".mcap", ".json"}


def test_an_empty_results_file_is_not_left_behind(tmp_path: Path) -> None:
    """But one that was there, empty, is not taken away."""
    (tmp_path / "there.db").touch()
    for name in ("new.db", "there.db"):
        with disk_full(), pytest.raises(InputError, match="cannot use the results file"):
            Results(tmp_path / name, create=True)
    assert [path.name for path in tmp_path.iterdir()] == ["there.db"]

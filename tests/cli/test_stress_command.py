"""irtrack stress: scenes of the suite, lost runs at each severity, bad input."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from irtrack.bench import Entry
from irtrack.bench.suite import stress_suite
from irtrack.cli import main
from irtrack.errors import InputError
from irtrack.registry.table import make

Cli = Callable[..., tuple[int, str, str]]


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Cli:
    """`irtrack stress WORDS` in an empty folder: (exit status, output, errors)."""
    monkeypatch.chdir(tmp_path)

    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["irtrack", "stress", *words])
        with pytest.raises(SystemExit) as caught:
            main()
        said = capsys.readouterr()
        return int(caught.value.code or 0), said.out, said.err

    return call


def test_suite_has_all_causes_at_all_severities() -> None:
    kalman = [Entry("kalman", make("kalman", {}))]
    whole = stress_suite(kalman, 30)
    assert len(whole.sources) == 9 * 6
    assert whole.seeds == 30
    some = stress_suite(kalman, 2, ["drops"])
    assert [each.name for each in some.sources] == [f"drops@{severity}" for severity in range(6)]
    with pytest.raises(InputError, match=r"cause 'drop': allowed: clutter, .*did you mean 'drops'"):
        stress_suite(kalman, 2, ["drop"])


def test_table_and_json_agree(cli: Cli) -> None:
    """A stationary estimate loses the target from the first severity on; template does not."""
    words = ("still=sound_tracker:Constant,template", "--seeds", "1", "--only", "drops")
    status, out, _ = cli(*words)
    assert status == 0
    head, *rows = out.splitlines()
    assert head.split() == ["cause", "tracker", *"012345", "half", "lost", "at"]
    assert rows[0].split() == ["drops", "still", *6 * ["100%"], "<", "0", "(<", "0", "to", ">", "5)"]
    assert rows[1].split()[:3] == ["drops", "template", "0%"]
    assert rows[-1] == "results: stress.db    next: irtrack report stress.db"
    found = json.loads(cli(*words, "--json")[1])
    (drops,) = found["causes"]
    assert drops["source"] == "drops"
    assert drops["breaking"]["still"]["lost"] == 6 * [1]
    assert drops["breaking"]["template"]["runs"] == 6 * [1]


GRID = """
about: drops, seen by a camera with more and with less noise
sources:
  - {source: stress/drops, severities: [0, 2], name: quiet, changes: {frames: 40, camera.netd_mk: 10}}
  - {source: stress/drops, severities: [0, 2], name: noisy, changes: {frames: 40, camera.netd_mk: 900}}
trackers: [kalman]
"""


def test_own_suite_runs_at_its_severities(cli: Cli) -> None:
    Path("grid-suite.yaml").write_text(GRID)
    words = ("template", "--suite", "grid-suite.yaml", "--seeds", "1", "--results", "grid.db")
    status, out, _ = cli(*words)
    assert status == 0
    head, *rows = out.splitlines()
    assert head.split() == ["cause", "tracker", "0", "2", "half", "lost", "at"]
    assert [row.split()[:2] for row in rows[:2]] == [["noisy", "template"], ["quiet", "template"]]
    assert rows[2].startswith("0 to 2: ")
    assert [each["source"] for each in json.loads(cli(*words, "--only", "quiet", "--json")[1])["causes"]] == ["quiet"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["kalmn"], "unknown tracker 'kalmn'"),
        (["kalman", "--only", "nois"], "cause 'nois': allowed: clutter"),
        (["kalman", "--suite", "suites/quick-suite"], "sky has at most one severity"),
        (["kalman", "--suite", ""], "the name is empty"),
        (["kalman", "--suite", "strss-suite"], "no shipped suite of that name; allowed: suites/hard-suite, "),
        (["kalman", "--suite", "suites/strss-suite"], "did you mean 'suites/stress-suite'?"),
        (["kalman", "--suite", "sky"], "sky.yaml:3:1: has the keys of a scenario, not of a suite; allowed: a suite, "),
        (["kalman", "--suite", "stress/scr"], "has the keys of a scenario, not of a suite"),
        (["kalman,kalman", "--only", "drops"], "two trackers are labelled 'kalman'"),
        (["kalman", "--seeds", "0"], "--seeds"),
        (["kalman", "--results", "none/stress.db"], "none/stress.db"),
        (["kalman", "--results", "notes.txt"], "notes.txt: allowed: a name that ends in .db"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_input_is_one_line(cli: Cli, words: list[str], said: str) -> None:
    status, out, err = cli(*words)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err

"""irtrack falsify: bad input is one line, and the scenario's file is never replaced."""

from __future__ import annotations

from pathlib import Path

import planted_failure
import pytest
from command_line import Call

from irtrack.errors import InputError
from irtrack.falsify import find_failure


@pytest.fixture
def cli(bare_call: Call, tmp_path: Path) -> Call:
    """`irtrack falsify WORDS` in a folder that holds blind.yaml."""
    (tmp_path / "blind.yaml").write_text(planted_failure.SCENE)
    return lambda *words: bare_call("falsify", *words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["blind.yaml", "--tracker", "kalman", "--search", "cmaes"],
            "search 'cmaes': allowed: cma, sobol, random; did",
        ),
        (["blind.yaml", "--tracker", "kalman", "--fresh", "4"], "fresh 4: allowed: 5 or more"),
        (["sky", "--tracker", "kalman"], "sky.yaml: vary: nothing varies that could be searched"),
        (
            ["blind.yaml", "--tracker", "kalman", "-o", "blind.yaml"],
            "blind.yaml: is no folder; allowed: the name of a folder",
        ),
        (["blind.yaml", "--tracker", "kalman", "-o", "bad"], "bad/trials.jsonl:1: is no trial"),
        (["some.mcap", "--tracker", "kalman"], "some.mcap: is a recording, in which nothing varies"),
    ],
)
def test_bad_input_is_one_line(cli: Call, words: list[str], said: str) -> None:
    Path("bad").mkdir()
    Path("odd/trials.jsonl").mkdir(parents=True)
    Path("bad/trials.jsonl").write_text("{}\n")
    Path("some.mcap").write_bytes(b"\x89MCAP")
    status, out, err = cli(*words)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err


@pytest.mark.parametrize("name", ["minimal.yaml", "report.md", "trials.jsonl"])
def test_scenario_file_is_not_replaced(cli: Call, name: str) -> None:
    """The error comes before the search."""
    Path(name).write_text(planted_failure.SCENE)
    words = (name, "--tracker", "planted_failure:Blind", "-o", ".")
    assert cli(*words) == (
        2,
        "",
        f"irtrack: {name}: would replace {name}, which this command needs; allowed: another name\n",
    )
    assert {path.name for path in Path().iterdir()} == {"blind.yaml", name}
    assert Path(name).read_text() == planted_failure.SCENE
    with pytest.raises(InputError, match="would replace"):
        find_failure(name, "planted_failure:Blind", ".")

"""All that is wrong with a scenario is told at once, in its tables too."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenario_text import TEXT, errors_of

from irsim.errors import InputError
from irsim.lint.warnings import warnings

WRONG = """\
severities:
  camera.netd_mk: [10, -3, 90]
  camera.bogus: [1, 2, 3]
  targets.jet.path.speed: [fast, 2, 3]
  camera.rate_hz: [30, 30, -5]
  frames: 5
vary:
  camera.bits: {kind: integers, low: 10, high: 20}
  targets.jat.path.speed: {kind: uniform, low: 1, high: 2}
  camera.time_constant_ms: {kind: unifrm, low: 1, high: 2}
  camera.size.0: {kind: choice, values: [64, none, 0]}
"""


def test_all_that_is_wrong_in_the_tables_is_told_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    """Keys that lead nowhere, entries that are none, values that cannot be; of other severities by check only."""
    path = tmp_path / "f.yaml"
    path.write_text(TEXT + WRONG)
    with pytest.raises(InputError) as caught:
        warnings(path)
    told = [line.removeprefix(f"{path}:").split(":")[0] for line in str(caught.value).splitlines()]
    assert told == ["27", "28", "29", "30", "31", "33", "34", "35", "36", "36"], str(caught.value)
    loaded = [line.split(":")[1] for line in errors_of(TEXT + WRONG)]
    assert loaded == ["28", "29", "31", "33", "34", "35", "36", "36"]


def test_beside_what_is_wrong_elsewhere_the_keys_of_the_tables_are_told() -> None:
    lines = errors_of(TEXT.replace("frames: 1e1", "frames: some") + WRONG)
    assert [line.split(":")[1] for line in lines] == ["3", "28", "29", "31", "34", "35"]

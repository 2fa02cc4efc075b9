"""No shipped scenario has warnings at its ends of severity, except for a sky with the clouds of a paper."""

from __future__ import annotations

from pathlib import Path

import pytest

from irsim.lint.warnings import warnings
from irsim.scenario.catalog import shipped
from irsim.scenario.loader import load

FOLDERS = ("examples", "new", "regressions", "sources", "stress")
SCENES = [path for folder in FOLDERS for path in shipped(folder).values()]
COLD_CLOUDS = "the layer clouds looks 272 K, colder than the clear sky"


@pytest.mark.usefixtures("beside_footage")
@pytest.mark.parametrize("path", SCENES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_shipped_scenarios_have_no_warnings(path: Path) -> None:
    last = min(map(len, load(path).severities.values()), default=1) - 1
    for severity in {0, last}:
        found = warnings(path, [f"severity={severity}"])
        assert [line for line in found if COLD_CLOUDS not in line] == []
        assert len(found) == path.stem.startswith("li-aircraft")

"""No shipped scenario is doubted, at none of its severities, but for a sky whose clouds are what a paper says."""

from __future__ import annotations

from pathlib import Path

import pytest

from irsim.lint.warnings import warnings
from irsim.scenario.catalog import shipped
from irsim.scenario.loader import load

FOLDERS = ("examples", "new", "regressions", "sources", "stress")
SCENES = [path for folder in FOLDERS for path in shipped(folder).values()]
COLD_CLOUDS = "the layer clouds looks 272 K, colder than the clear sky"


@pytest.mark.sampled
@pytest.mark.usefixtures("beside_footage")
@pytest.mark.parametrize("path", SCENES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_shipped_scenario_is_doubted(path: Path) -> None:
    most = min(map(len, load(path).severities.values()), default=1) - 1
    for severity in {0, most}:
        told = warnings(path, [f"severity={severity}"])
        assert [line for line in told if COLD_CLOUDS not in line] == []
        assert len(told) == path.stem.startswith("li-aircraft")

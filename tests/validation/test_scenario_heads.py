"""The figures in the head of every scenario of the papers, and of the hard ones, agree with measurements."""

from __future__ import annotations

from pathlib import Path

import pytest
from scene_figures import check_head

from irsim.scenario.catalog import shipped

PATHS = shipped("sources") | {name: path for name, path in shipped("stress").items() if name.startswith("hard-")}


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS.keys())
def test_head_agrees_with_measurement(path: Path) -> None:
    check_head(path)

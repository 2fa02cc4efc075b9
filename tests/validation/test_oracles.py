"""Metrics, multiple models and data association equal other implementations on 1,000 random cases each.

The comparisons are those of `make test` on stored values; here the values are computed anew by the environment that
`make oracles` makes, or by the Python named in ORACLES_PYTHON.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ORACLES = Path(os.environ.get("ORACLES_PYTHON") or ROOT / ".venv-oracles" / "bin" / "python")
CASES = 1000
COMPARISONS = (
    "irtrack/metrics/test_multiple.py::test_figures_equal_trackeval",
    "irtrack/metrics/test_detection_figures.py::test_masks_equal_pyirstdmetrics",
    "irtrack/filters/test_multiple_model.py::test_imm_equals_filterpy",
    "irtrack/filters/test_data_association.py::test_joint_probabilities_equal_stone_soup",
    "irtrack/trackers/test_h_infinity.py::test_states_equal_filterpy",
    "irtrack/points/test_points.py::test_states_equal_filterpy",
    "irtrack/trackers/test_pdaf.py::test_probabilities_equal_stone_soup",
    "irtrack/models/test_classifiers.py::test_classifiers_equal_scikit_learn",
)

pytestmark = pytest.mark.skipif(not ORACLES.exists(), reason="no .venv-oracles; make oracles installs it")


def test_ours_equal_the_oracles(tmp_path: Path) -> None:
    values = tmp_path / "values.json"
    script = ROOT / "tests" / "support" / "oracle_values.py"
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with values.open("w") as file:
        subprocess.run([ORACLES, script, str(CASES)], stdout=file, check=True, env=alone)
    tests = [str(ROOT / "tests" / name) for name in COMPARISONS]
    answer = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests],
        capture_output=True,
        text=True,
        env=os.environ | {"ORACLE_VALUES": str(values)},
        cwd=ROOT,
        check=False,
    )
    assert answer.returncode == 0, answer.stdout[-3000:]
    passed = re.search(r"(\d+) passed", answer.stdout)
    assert passed is not None
    assert int(passed[1]) == CASES * len(COMPARISONS)

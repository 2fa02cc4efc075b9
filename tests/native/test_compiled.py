"""Compiled loops and the plain ones do the same; without a compiler there are the plain ones."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

import irsim
import irsim._native
import irtrack._native
from irsim._native.loading import load
from irtrack.features.histogram import bhattacharyya
from irtrack.features.mean_shift import mean_shift
from irtrack.features.quantiser import full_range
from irtrack.features.trajectory import trajectory_similarity
from irtrack.filters.particle import Weights

ROOT = Path(__file__).parents[2]
SCENES = ["entrant", str(ROOT / "tests" / "bench" / "full_chain.yaml")]
RENDER = """
import pickle, sys
import irsim, irsim._native
assert not irsim._native.COMPILED
scenes = map(irsim.load, sys.argv[1:])
pickle.dump([next(irsim.frames(scene, 9)) for scene in scenes], sys.stdout.buffer)
"""


def can_compile() -> bool:
    return bool(shutil.which("cc")) and Path(sysconfig.get_path("include"), "Python.h").exists()


@pytest.mark.skipif(not can_compile() or bool(os.environ.get("IRSIM_PLAIN")), reason="no compiler, or not wanted")
def test_kernels_are_compiled_where_they_can_be() -> None:
    assert irsim._native.COMPILED
    assert irtrack._native.COMPILED


def test_without_a_compiler_the_plain_loops_run(tmp_path: Path) -> None:
    """Old binaries are removed."""
    shutil.copy(ROOT / "hatch_build.py", tmp_path)
    for package in ("irsim", "irtrack"):
        shutil.copytree(ROOT / package / "_native", tmp_path / package / "_native")
    done = subprocess.run(
        [sys.executable, "hatch_build.py"],
        cwd=tmp_path,
        env={**os.environ, "CC": "/nowhere/cc"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "compiled: nothing; the plain loops will run\n"
    assert not list(tmp_path.rglob("_kernels*.so"))


def test_kernels_take_arrays_of_any_order_and_type() -> None:
    """Arrays in column order, numpy integers and other floats, as a user's own tracker may give them."""
    level = np.zeros((40, 40), np.uint8)
    level[20:24, 10:14] = 200
    quantiser, h = full_range(8, 16), (4.0, 4.0)
    reference = np.full(16, 1 / 16)
    columns = np.array([[10.0, 12.0], [20.0, 22.0]]).T
    found = mean_shift(level, columns, h, quantiser, reference, np.int64(3))  # type: ignore[arg-type]  # a whole number of numpy's is the test
    assert (found.centers == mean_shift(level, columns.copy(), h, quantiser, reference, 3).centers).all()
    places = np.arange(8.0).reshape(2, 4).T
    assert trajectory_similarity(places, columns, "lambda") == pytest.approx(
        trajectory_similarity(places.copy(), columns.copy(), "lambda")
    )
    assert np.isscalar(bhattacharyya(reference, reference))
    weights = Weights(np.array([0.5, 1.0], np.float32), np.array([1.0, 1.0], np.float32), 2.0)
    assert pytest.approx([np.exp(-1) / (1 + np.exp(-1)), 1 / (1 + np.exp(-1))]) == weights.W


@pytest.mark.skipif(not irsim._native.COMPILED, reason="nothing is compiled")
def test_a_kernel_of_other_source_is_warned_of_and_not_used(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="irsim._native was compiled from other source .*make install"):
        assert load("irsim._native", tmp_path) is None


@pytest.mark.slow
@pytest.mark.skipif(not irsim._native.COMPILED, reason="nothing is compiled")
def test_scenes_are_rendered_alike_by_both() -> None:
    """The light of bodies may differ in its last digits, and so a rounded count by one."""
    done = subprocess.run(
        [sys.executable, "-c", RENDER, *SCENES], env={**os.environ, "IRSIM_PLAIN": "1"}, capture_output=True, check=True
    )
    for name, (frame, truth) in zip(SCENES, pickle.loads(done.stdout), strict=True):
        own_frame, own_truth = next(irsim.frames(irsim.load(name), 9))
        off = np.abs(own_frame.image.astype(int) - frame.image)
        assert off.max() <= 1, name
        assert (off > 0).mean() < 1e-3, name
        assert _numbers(own_truth) == pytest.approx(_numbers(truth), rel=1e-6, abs=1e-6, nan_ok=True)


def _numbers(truth: irsim.Truth) -> list[float]:
    return [
        value
        for each in truth.targets
        for value in (*each.center, *each.signal_center, *each.box.pixels, each.visible, each.contrast_k or 0.0)
    ]

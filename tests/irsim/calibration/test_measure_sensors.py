"""Noise of real sensors, beside the figures that the data's README states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irsim.measure import measure_noise
from irsim.types import Floats

REAL = Path(__file__).resolve().parents[4] / "shared" / "real"
real = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")


def raw(name: str) -> Floats:
    with np.load(REAL / name / "frames.npz") as file:
        return np.asarray(file["frames"])


@real
def test_a_cooled_corrected_sensor() -> None:
    """The data's README: pair 1.75, tvh 1.65, lag-1 correlation .01, fixed pixel .66, drift .35 counts."""
    report = measure_noise(raw("raw14_lwir"), 30.0, top=16383)
    assert report.temporal.pair.value == pytest.approx(1.75, rel=0.05)
    assert report.terms.tvh.value == pytest.approx(1.65, rel=0.08)
    assert report.temporal.memory is None
    assert report.temporal.correlation[0].value == pytest.approx(0.01, abs=0.02)
    assert report.terms.vh.value == pytest.approx(0.66, rel=0.1)
    assert report.drift == pytest.approx(0.35, abs=0.05)


@real
def test_a_cooled_uncorrected_sensor() -> None:
    """The data's README: tvh 3.3, lag-1 -.01, fixed pixel 16, column 3, row 52 over odd and even rows."""
    report = measure_noise(raw("raw14_mwir"), 30.0, top=16383)
    assert report.terms.tvh.value == pytest.approx(3.3, rel=0.08)
    assert report.temporal.memory is None
    assert report.terms.vh.value == pytest.approx(16, rel=0.1)
    assert report.terms.h.low < 3.5
    assert report.terms.v.value > 5 * report.terms.h.value


@real
def test_an_uncooled_sensor_remembers() -> None:
    """The data's README: AR(1) with rho about .9; lag-1 .74 to .89; tvh 1.4 to 3.5; pixel 2.5 to 6.4."""
    report = measure_noise(raw("raw16_lepton"), 9.0)
    memory = report.temporal.memory
    assert memory is not None
    assert memory.rho.value == pytest.approx(0.9, abs=0.03)
    assert 1.4 < memory.total.value < 3.5
    assert 2.5 < report.terms.vh.value < 6.4
    assert 0.5 < report.temporal.pair.value < 2.1
    assert 0.8 < report.drift < 17

"""Random fields: spectrum, statistics and histogram."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.geometry.random_fields import power_law, profile, spectral, with_histogram


@pytest.mark.parametrize("betas", [None, (2.0, 3.0)])
def test_a_field_is_standardised_periodic_and_addressed(betas: tuple[float, float] | None) -> None:
    field = spectral((64, 96), 2.5, betas, 12.0, 1.0, 7, "a", 1)
    assert field.shape == (64, 96)
    assert field.dtype == np.dtype(np.float32)
    assert field.mean() == pytest.approx(0, abs=1e-6)
    assert field.std() == pytest.approx(1, abs=1e-6)
    np.testing.assert_array_equal(field, spectral((64, 96), 2.5, betas, 12.0, 1.0, 7, "a", 1))
    assert not np.array_equal(field, spectral((64, 96), 2.5, betas, 12.0, 1.0, 7, "a", 2))
    # Its edges meet as closely as neighbouring rows do.
    assert np.abs(field[0] - field[-1]).mean() < 1.5 * np.abs(np.diff(field, axis=0)).mean()


def test_its_power_falls_with_its_slope() -> None:
    power = np.mean(
        [np.abs(np.fft.rfft2(power_law((256, 256), 3.0, 1e6, 1.0, seed, "f"))) ** 2 for seed in range(8)], axis=0
    )
    frequency = np.hypot(np.fft.rfftfreq(256)[None, :], np.fft.fftfreq(256)[:, None])
    band = (frequency > 0.02) & (frequency < 0.3)
    slope = np.polyfit(np.log(frequency[band]), np.log(power[band]), 1)[0]
    assert slope == pytest.approx(-3.0, abs=0.1)
    line = profile(4096, 3.0, 50.0, 0, "l")
    assert (line.mean(), line.std()) == pytest.approx((0, 1), abs=1e-9)


def test_a_histogram_replaces_values_of_equal_rank() -> None:
    field = power_law((128, 128), 2.5, 16.0, 1.0, 0, "h")
    uniform = with_histogram(field, (0.0, 1.0))
    np.testing.assert_array_equal(np.argsort(field, axis=None)[::997], np.argsort(uniform, axis=None)[::997])
    assert (uniform.mean(), uniform.std()) == pytest.approx((0, 1), abs=0.1)
    shares, _ = np.histogram(uniform, bins=4, range=(-np.sqrt(3), np.sqrt(3)))
    assert shares / shares.sum() == pytest.approx([0.25] * 4, abs=0.06)
    assert with_histogram(field, ()) is field

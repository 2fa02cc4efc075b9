"""Extinction of fog in each band, against Mie scattering by its drops."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.physics.climate import FOG
from irsim.types import BandName


def extinction(size: float, index: complex) -> float:
    """Return Mie's efficiency of extinction of a sphere of size parameter `size` (Bohren & Huffman, 1983, ch. 4)."""
    orders = int(size + 4 * size ** (1 / 3) + 2)
    y = index * size
    ratio = np.zeros(max(orders, int(abs(y))) + 16, complex)
    for n in range(len(ratio) - 1, 0, -1):
        ratio[n - 1] = n / y - 1 / (ratio[n] + n / y)
    psi, chi, total = [np.cos(size), np.sin(size)], [-np.sin(size), np.cos(size)], 0.0
    for n in range(1, orders + 1):
        psi = [psi[1], (2 * n - 1) * psi[1] / size - psi[0]]
        chi = [chi[1], (2 * n - 1) * chi[1] / size - chi[0]]
        now, before = psi[1] - 1j * chi[1], psi[0] - 1j * chi[0]
        for factor in (ratio[n] / index, ratio[n] * index):
            inner = factor + n / size
            total += (2 * n + 1) * ((inner * psi[1] - psi[0]) / (inner * now - before)).real
    return 2 / size**2 * total


WATER: dict[BandName, list[tuple[float, complex]]] = {
    "mwir": [(3.5, 1.400 + 0.0094j), (4.0, 1.351 + 0.0046j), (4.5, 1.332 + 0.0134j)],
    "lwir": [(8.0, 1.291 + 0.0343j), (9.0, 1.262 + 0.0399j), (10.0, 1.218 + 0.0508j), (11.0, 1.153 + 0.0968j),
             (12.0, 1.111 + 0.199j)],
}  # fmt: skip
"""Wavelength, um, and refractive index of water (Hale & Querry 1973)."""


@pytest.mark.parametrize("band", WATER)
@pytest.mark.parametrize(("kind", "power", "rate"), [("advection", 3, 0.3), ("radiation", 6, 3.0)])
def test_fog_extinction_is_that_of_mie_scattering(band: BandName, kind: str, power: float, rate: float) -> None:
    radius = np.linspace(0.2, 50, 110)
    weight = radius ** (power + 2) * np.exp(-rate * radius)
    keep = weight > 1e-4 * weight.max()

    def mean(um: float, index: complex) -> float:
        each = [extinction(2 * np.pi * r / um, index) for r in radius[keep]]
        return float(np.average(each, weights=weight[keep]))

    visible = mean(0.55, 1.333)
    found = np.mean([mean(um, index) / visible for um, index in WATER[band]])
    assert FOG[kind][band] == pytest.approx(found, abs=0.02)

"""Means and contributions of a region are those of the whole picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from quiet_scenes import small as scene

from irsim.render.moments import Exact, MeanCounts, Moments
from irsim.scenario.model import Scenario

SIZE = (96, 64)
CLOUDS = [{"id": "high", "range_m": 8000.0}, {"id": "low", "range_m": 1200.0, "evolve_s": 20.0}]
SCENES: dict[str, dict[str, Any]] = {
    "landscape": {"background": {"kind": "landscape", "clouds": CLOUDS}, "atmosphere": {"preset": "us_standard"}},
    "falloff, a well": {"camera": {"falloff": {"vignetting": 0.3}, "detector": {"kind": "electrons"}}},
    "lag": {"camera": {"time_constant_ms": 12.0}},
    "bloom": {"camera": {"bloom": {}, "range_k": (280.0, 300.0)}},
    "smear": {
        "camera": {"smear": {"time_ms": 30.0, "steps": 3}, "motion": [{"kind": "pan", "azimuth_deg_s": 4.0}]},
        "background": {"kind": "sky", "clouds": CLOUDS},
    },
}


def several(**other: Any) -> Scenario:
    """Return four targets: two cross, one requests a contrast and one an SCR, before and behind a bar."""
    paths = {
        "one": (50.0, 30.0, 1000.0),
        "near": (54.0, 32.0, 800.0),
        "requesting": (20.0, 20.0, 900.0),
        "outside": (-20.0, 9.0, 900.0),
    }
    shapes: dict[str, dict[str, Any]] = {
        "requesting": {"kind": "point", "contrast_k": 5.0},
        "outside": {"kind": "point", "scr": 5.0},
    }
    targets = [
        {
            "id": name,
            "shape": shapes.get(name, {"kind": "fighter"}),
            "path": {"kind": "straight", "start": (x, y), "speed": 2.0, "range_m": range_m},
            "contrast": 0.7 if name == "near" else 1.0,
        }
        for name, (x, y, range_m) in paths.items()
    ]
    bar = {"kind": "bar", "center_px": (60.0, 30.0), "size_px": (8.0, 60.0), "range_m": 300.0}
    camera = {"size": SIZE, "psf_px": 0.7, **other.pop("camera", {})}
    return scene(targets=targets, occluders=[bar], camera=camera, **other)


@pytest.mark.parametrize("name", SCENES)
def test_moments_of_a_region_are_cut_from_the_whole(name: str) -> None:
    scenario = several(**SCENES[name])
    moments = Moments(scenario)
    levels = MeanCounts(moments._renderer)
    left, top, columns, rows = region = (41, 17, 30, 25)

    def within(picture: Exact) -> Exact:
        return picture[top : top + rows, left : left + columns]

    np.testing.assert_allclose(moments.mean(2, region), within(moments.mean(2)), rtol=1e-13)
    assert np.array_equal(moments.variance(2, region), within(moments.variance(2)))
    for target, shift in (
        ("one", (0.3, -0.2)),
        ("near", (0.0, 0.0)),
        ("requesting", (9.0, 2.0)),
        ("outside", (70.0, 20.0)),
    ):
        whole = np.asarray(levels.of(2, {target: shift}) - levels.of(2, absent=target), np.float64)
        np.testing.assert_allclose(moments.contribution(2, target, shift), whole, atol=1e-8)
        np.testing.assert_allclose(moments.contribution(2, target, shift, region), within(whole), atol=1e-8)
        assert np.abs(whole).max() > 1


def test_a_target_elsewhere_contributes_nothing() -> None:
    assert not Moments(several()).contribution(1, "one", (0.0, 0.0), (0, 0, 16, 16)).any()
    assert not Moments(several()).contribution(1, "outside").any()

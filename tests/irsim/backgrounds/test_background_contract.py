"""Contract of every registered background: layers, switches, crops, moving cameras, and frames in any order."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from carried import CLOUDS, scene

from irsim.backgrounds import BACKGROUNDS, crop, is_semi_transparent
from irsim.physics.radiometry import temperature
from irsim.recording import record
from irsim.render.frame import Renderer
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.types import Floats

COVER: dict[str, Any] = {"fields": {}, "roads": {}, "water": {}, "clutter": {"per_mrad2": 0.02}}
CLOUD_LAYERS: list[dict[str, Any]] = [
    {"id": "low", "range_m": 900.0, "wind_mrad_s": (-1.0, 0.5), **CLOUDS},
    {"id": "high", "range_m": 3000.0, "wind_mrad_s": (2.0, 0.5), "evolve_s": 4.0, "sunlit_k": 5.0, **CLOUDS},
]
KEYS: dict[str, dict[str, Any]] = {
    "sky": {"clouds": CLOUD_LAYERS},
    "ground": {"height_m": 80.0, **COVER},
    "landscape": {
        "camera_height_m": 80.0,
        **COVER,
        "clouds": CLOUD_LAYERS,
        "trees": [{"id": "row", "range_m": 500.0, "relief_m": 2.0}],
        "buildings": [{"id": "town", "range_m": 700.0}],
    },
    "sea": {"camera_height_m": 80.0, "sun_deg": (2.0, 12.0), "clouds": CLOUD_LAYERS},
    "recording": {},
}
"""Each kind with all of its parts; a kind without an entry has its defaults."""

KINDS = [name for name, _ in BACKGROUNDS]
PAINTED = [kind for kind in KINDS if kind != "recording"]


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> str:
    still = Scenario.model_validate({"frames": 5, "camera": {"size": (161, 121)}, "background": {"kind": "ground"}})
    return str(record(Rendering(still), tmp_path_factory.mktemp("footage") / "own.mcap", stop=5))


def moving(kind: str, footage: str, **camera: Any) -> Scenario:
    """Return a scene whose camera moves and pans over its horizon or ground."""
    keys = {"file": footage} if kind == "recording" else KEYS.get(kind, {})
    camera = {"elevation_deg": -20.0 if kind == "ground" else -1.0, **camera}
    return scene({"kind": kind, **keys}, (8.0, 20.0, 1.0), camera=camera, atmosphere={"preset": "us_standard"})


@lru_cache
def renderer_of(kind: str, footage: str) -> Renderer:
    return Renderer(moving(kind, footage))


@pytest.mark.parametrize("kind", KINDS)
def test_layers_stand_far_to_near(kind: str, footage: str) -> None:
    """The first layer is opaque and the farthest; each of the others can be switched off by its name."""
    renderer = renderer_of(kind, footage)
    first, *others = renderer.layers
    view = renderer.now(0).view_direction(0)
    transmittance, emission = first.light(view)
    assert transmittance is None
    assert emission.shape == (121, 161)
    assert emission.dtype == np.float32
    assert np.all(emission > 0)
    ranges = [layer.range_m for layer in (first, *others)]
    assert ranges[0] == max(ranges)
    assert {layer.name for layer in others} == {name for name, _ in renderer.scenario.background.names()}
    clouds = [layer.range_m for layer in others if layer.name in ("low", "high")]
    assert clouds == sorted(clouds, reverse=True)
    for layer in others:
        through, own = layer.light(view)
        assert through is not None
        assert -0.01 < through.min() <= through.max() < 1.01
        assert own.min() > -0.01 * emission.max()
    assert kind == "recording" or 200.0 < float(temperature("mwir", renderer.context.surroundings)) < 300.0


@pytest.mark.parametrize(("kind", "smear"), [*((kind, None) for kind in KINDS), ("sky", {"time_ms": 20.0, "steps": 2})])
def test_any_frame_stands_alone(kind: str, smear: dict[str, Any] | None, footage: str) -> None:
    """In any order, for a moving camera, across the boundary of a block of frames."""
    back = Renderer(moving(kind, footage, smear=smear))
    forth = Renderer(back.scenario) if smear else renderer_of(kind, footage)
    expected = {frame: forth.scene(frame)[0].copy() for frame in (7, 8)}
    assert kind == "recording" or not np.array_equal(expected[7], expected[8])
    for frame in (8, 7):
        np.testing.assert_array_equal(back.scene(frame)[0], expected[frame])


@pytest.mark.parametrize("kind", KINDS)
def test_a_region_equals_the_full_frame(kind: str, footage: str) -> None:
    """Cropped layers give the light and the transmittance of the full frame to the last bit."""
    renderer = renderer_of(kind, footage)
    view, region = renderer.now(9).view_direction(9), (slice(30, 80), slice(20, 90))
    first, *others = renderer.layers
    under: Floats = first.light(view)[1].astype(np.float64)
    cropped = crop(first, view, region)
    assert cropped is not None
    np.testing.assert_array_equal(cropped.light(view)[1], under[region].astype(np.float32))
    for layer in others:
        part = crop(layer, view, region)
        assert part is not None
        light = np.empty_like(under)
        if is_semi_transparent(layer):
            layer.blend(under, light, view, [])
        else:
            through, emission = layer.light(view)
            assert through is not None
            light = under * through + emission
        within = np.empty_like(under[region])
        if is_semi_transparent(part):
            part.blend(under[region].copy(), within, view, [])
            np.testing.assert_array_equal(within, light[region])
        under = light


@pytest.mark.parametrize("kind", PAINTED)
def test_layers_at_a_range_or_height_have_parallax(kind: str, footage: str) -> None:
    """Only infinitely distant layers have none."""
    renderer = renderer_of(kind, footage)
    here, there = renderer.now(0).view_direction(0), renderer.now(60).view_direction(60)
    still = renderer.layers[:1] if renderer.scenario.background.surface_m is None else []
    for layer in renderer.layers:
        before, after = (layer.light(replace(each, time=0.0, key=None))[1] for each in (here, there))
        if before.any() or after.any():  # a row of trees may lie outside this small picture
            assert (np.abs(after - before).max() > 0.1 * np.std(before)) == (layer not in still), layer.name

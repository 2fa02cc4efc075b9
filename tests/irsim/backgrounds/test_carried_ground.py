"""A camera that is carried: ground of a height, and the sea, pass by as the planes that they are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from carried import apart, layer_of, resampled, scene

from irsim.backgrounds.chart import Chart
from irsim.backgrounds.ground_texture import Level
from irsim.geometry.projection import Geometry
from irsim.render.frame import Renderer


def test_ground_without_a_height_stays() -> None:
    still, moving = (Renderer(scene({"kind": "ground"}, (speed, 0.0, 0.0))) for speed in (0.0, 30.0))
    np.testing.assert_array_equal(still.scene(0)[0], moving.scene(60)[0])


@pytest.mark.parametrize(
    ("elevation_deg", "velocity"),
    [
        (-20.0, (1.0, 0.0, 0.0)),
        (-35.0, (0.3, 1.2, 0.0)),
        (-35.0, (0.0, 0.0, 1.0)),
        (-70.0, (0.2, -0.5, -0.3)),
        (-80.0, (0.3, -0.5, 0.4)),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_what_stands_on_the_ground_does_not_slide_over_it(
    elevation_deg: float, velocity: tuple[float, float, float], turned: bool
) -> None:
    """The first picture, seen through the plane 80 m below as a body on it is, is the last one."""
    points = [
        {
            "id": f"at_{x}",
            "shape": {"kind": "point", "area_m2": 1.0},
            "path": {"kind": "straight", "start": (x, y), "speed": 0.0, "ground_m": 80.0},
        }
        for x, y in ((60, 50), (80, 60), (110, 75))
    ]
    if turned:
        velocity = (6 * velocity[0], 6 * velocity[1], 6 * velocity[2])
    motion: list[dict[str, Any]] = [{"kind": "platform", "velocity_m_s": velocity}]
    if turned:
        motion.append({"kind": "tracks", "target": "at_80", "lag_s": 0.0, "place_px": (80, 60)})
    background = {"kind": "ground", "height_m": 80.0, "correlation_mrad": 8.0, "beta": 3.0}
    camera = {"elevation_deg": elevation_deg, "motion": motion}
    renderer = Renderer(scene(background, velocity, camera=camera, targets=points))
    first, pose = renderer.context.geometry, renderer.pose(60)
    y, x = np.mgrid[30:91, 45:116]
    rays = pose.lens.directions(np.stack([x, y], axis=-1)) @ pose.rotation
    reach = (80 - pose.place @ first.down) / (rays @ first.down)
    seen = np.asarray(first.project(pose.place + rays * reach[..., None]), np.float32)
    inside = np.asarray(((seen > 2) & (seen < np.array(first.size) - 3)).all(axis=-1))
    assert inside.mean() > 0.3
    before, after = (layer_of(renderer, "ground").light(renderer.now.view_direction(frame))[1] for frame in (0, 60))
    wanted = resampled(before, seen[..., 0], seen[..., 1])
    found = after[30:91, 45:116]
    assert apart(found, wanted, inside) == pytest.approx((0, 0), abs=0.05)
    assert np.corrcoef(wanted[inside], found[inside])[0, 1] > 0.98
    starts, ends = ({each.id: each.center for each in renderer.scene(frame)[1].targets} for frame in (0, 60))
    for name, (at_x, at_y) in ends.items():
        if 45 <= at_x <= 115 and 30 <= at_y <= 90:
            there = resampled(seen, np.array([[at_x - 45]]), np.array([[at_y - 30]]))
            assert there.ravel().tolist() == pytest.approx(starts[name], abs=0.1)


def test_ground_is_a_plane_straight_down_and_in_wide_pictures() -> None:
    """74 degrees wide, turned to the nadir: each pixel sees the texel that its ray meets, 80 m below."""
    geometry = Geometry((641, 481), 2e-3, math.radians(-80))
    turned = geometry.world_rotation(np.array([0.3, math.radians(-10), 0.2]))
    columns, rows, _ = Level(geometry, 80.0, (4096, 4096)).seen(Chart.at(geometry, turned), (0.0, 0.0, 0.0))
    y, x = np.mgrid[:481, :641].astype(float)
    right, down, ahead = np.moveaxis(geometry.directions(np.stack([x, y], axis=-1)) @ turned, -1, 0)
    first = math.sin(
        math.radians(80)
    )  # a texel is 2 mrad wide at the range 80 m / sin 80, and so high as seen slantwise
    across = right / down * first / 2e-3
    along = (1 / math.tan(math.radians(80)) - ahead / down) * first**2 / 2e-3
    for seen, met in ((columns, across), (rows, along)):
        np.testing.assert_allclose((seen - met + 2048) % 4096 - 2048, 0, atol=0.01)


def test_the_first_picture_of_ground_is_in_perspective() -> None:
    """Where the axis meets it, it is as without a height; pixels higher up see texels smaller, as range has it."""
    plain, plane = (
        Renderer(
            scene(
                {"kind": "ground", "correlation_mrad": 8.0, **height}, (0.0, 0.0, 0.0), camera={"elevation_deg": -20.0}
            )
        ).scene(0)[0]
        for height in ({}, {"height_m": 300.0})
    )
    here = slice(58, 63), slice(76, 85)
    assert plane[here] == pytest.approx(plain[here], abs=0.05 * float(np.std(plain)))
    # At a depression d texels are (sin 20 / sin d) px narrower, and nearer by (cot d - cot 20) sin(20)^2 rows.
    lower = math.radians(20.0) - math.atan(40 * 0.5e-3)
    first = math.radians(20.0)
    narrower = math.sin(first) / math.sin(lower) / math.cos(math.atan(40 * 0.5e-3))
    row = 60 - (1 / math.tan(lower) - 1 / math.tan(first)) * math.sin(first) ** 2 / 0.5e-3
    x = 80 + (np.arange(60.0, 101.0)[None] - 80) * narrower
    wanted = resampled(plain, x, np.full_like(x, row))[0]
    assert np.corrcoef(wanted, plane[20, 60:101])[0, 1] > 0.98


def test_far_ground_is_as_even_as_its_pixels_are_large() -> None:
    """White ground, seen from 3 degrees down on: pixels that see n texels spread less by sqrt(n), or they flicker."""
    camera = {"size": (400, 801), "ifov_mrad": 0.8, "elevation_deg": -21.0}
    background = {"kind": "ground", "height_m": 100.0, "beta": 0.0, "stretch": 1.0}
    light = Renderer(scene(background, (0.0, 0.0, 0.0), camera=camera)).scene(0)[0]
    spreads = light.std(axis=1)
    depressions = np.radians(21.0) + np.arctan((np.arange(801) - 400) * 0.8e-3)
    many = (math.sin(math.radians(21.0)) / np.sin(depressions)) ** 3
    far = many > 1
    steadied = (spreads[far] * np.sqrt(many[far])).reshape(-1, 25).mean(axis=1)
    assert len(steadied) == 16
    assert steadied == pytest.approx(np.full(16, steadied.mean()), rel=0.15)


def test_the_sea_passes_by_as_its_plane() -> None:
    """By 8 m to the right: what is 400 m off on the level has gone 20 mrad to the left, 40 px."""
    sea = {"kind": "sea", "camera_height_m": 20.0, "gusts": 0.0}
    renderer = Renderer(scene(sea, (8.0, 0.0, 0.0), camera={"elevation_deg": -3.0, "psf_px": 0.0}))
    there = renderer.now.view_direction(30)
    before, after = (
        renderer.layers[0].light(type(there)(0.0, there.chart, None, place))[1]
        for place in ((0.0, 0.0, 0.0), there.place)
    )
    row = round(60 + (math.atan(20 / 400) - math.radians(3.0)) / 0.5e-3)
    assert np.corrcoef(after[row, 40:81], before[row, 80:121])[0, 1] > 0.99

"""Moving camera: clouds, ground and sea pass by according to their range."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from carried import CLOUDS, apart, layer_of, passed, resampled, scene
from country import context, view_direction

from irsim.backgrounds.chart import Chart
from irsim.backgrounds.ground_texture import GroundPlane
from irsim.backgrounds.panorama import Sphere, from_origin
from irsim.geometry.projection import Geometry
from irsim.render.frame import Renderer

MIDDLE = slice(40, 81), slice(60, 101)
"""Rows and columns about the picture's middle."""
LASTING = 1e6
"""A cloud that evolves in so many seconds does not change in two."""


@pytest.mark.parametrize(
    ("way", "range_m", "shift_px", "evolve_s"),
    [("right", 2000.0, 20, 0.0), ("right", 8000.0, 5, LASTING), ("up", 2000.0, 20, LASTING)],
)
def test_clouds_have_the_parallax_of_their_range(way: str, range_m: float, shift_px: int, evolve_s: float) -> None:
    """A camera displaced by d sees a layer at R shifted by d / R: 80 m in 2 km are 40 mrad, 20 px of 2 mrad."""
    up = math.radians(10.0)  # across the line of sight, upwards
    velocity = (40.0, 0.0, 0.0) if way == "right" else (0.0, -40.0 * math.sin(up), 40.0 * math.cos(up))
    clouds = [{"id": "layer", "range_m": range_m, "evolve_s": evolve_s, **CLOUDS}]
    renderer = Renderer(scene({"kind": "sky", "clouds": clouds}, velocity, camera={"ifov_mrad": 2.0}))
    before, after = (passed(renderer, "layer", frame) for frame in (0, 60))
    across, down = (shift_px, 0) if way == "right" else (0, -shift_px)
    rows, columns = MIDDLE
    moved = before[rows.start + down : rows.stop + down, columns.start + across : columns.stop + across]
    assert np.std(moved) > 0.1
    # The picture turns with the sphere: of d / R = 0.04 at most, half the square over the patch's 20 px.
    assert apart(after[MIDDLE], moved) == pytest.approx((0, 0), abs=0.05)
    assert np.abs(after[MIDDLE] - moved).mean() < 0.05 * np.std(moved)


def test_approached_clouds_grow() -> None:
    """From 2000 m to 1600 m angles from the axis grow by 1.25."""
    up = math.radians(10.0)
    clouds = [{"id": "layer", "range_m": 2000.0, "evolve_s": LASTING, **CLOUDS}]
    renderer = Renderer(scene({"kind": "sky", "clouds": clouds}, (0.0, 200 * math.cos(up), 200 * math.sin(up))))
    before, after = (passed(renderer, "layer", frame) for frame in (0, 60))
    y, x = (np.asarray(at, np.float32) for at in np.indices(after.shape))
    grown = resampled(before, 80 + (x - 80) * 0.8, 60 + (y - 60) * 0.8)
    assert apart(after, grown) == pytest.approx((0, 0), abs=0.05)
    assert np.abs(after - grown).mean() < 0.02 * np.std(grown)


@pytest.mark.parametrize(
    ("place", "range_m", "turn"),
    [((-40.0, 25.0, 60.0), 300.0, (0.0, 0.0, 0.0)), ((0.0, -80.0, -120.0), 300.0, (1.2, 0.3, 0.4))],
)
def test_cloud_parallax_is_that_of_points_on_a_sphere(
    place: tuple[float, float, float], range_m: float, turn: tuple[float, float, float]
) -> None:
    camera = context(elevation_deg=12.0)
    chart = from_origin(view_direction(camera, place, turn), Sphere(range_m)).chart
    for x, y in ((0, 0), (80, 60), (160, 17)):
        ray = camera.geometry.directions(np.array([x, y])) @ camera.geometry.world_rotation(np.array(turn))
        gone = np.array(place)
        toward = ray @ gone
        point = gone + ray * (math.sqrt(toward**2 + range_m**2 - gone @ gone) - toward)
        u = math.atan2(point[0], point[2]) * math.cos(math.radians(12.0)) / 0.5e-3
        v = (math.radians(12.0) - math.asin(-point[1] / range_m)) / 0.5e-3
        assert (chart.at_pixels(chart.u)[y, x], chart.at_pixels(chart.v)[y, x]) == pytest.approx((u, v), abs=0.02)


def test_parallax_has_no_seam_past_the_zenith() -> None:
    """A camera half of the range back that looks steeply up sees beyond the zenith of the first place."""
    chart = from_origin(view_direction(context(elevation_deg=70.0), (30.0, 0.0, -1000.0)), Sphere(2000.0)).chart
    turns = np.diff(chart.u, axis=1) * 0.5e-3 / math.cos(math.radians(70.0))
    assert np.abs(turns).max() < math.pi / 2


JET = {"id": "jet", "shape": {"kind": "fighter"}}


THICK = {"clouds": [{"id": "cover", "range_m": 5000.0, "coverage": 0.999, "depth": 50.0}]}
BAR = {"kind": "bar", "id": "cover", "center_px": (80, 60), "size_px": (120, 100), "range_m": 500.0}


@pytest.mark.parametrize("hidden", [True, False])
@pytest.mark.parametrize(
    ("sky", "occluders", "cover_m"), [(THICK, [], 5000.0), ({}, [BAR], 500.0)], ids=["clouds", "bar"]
)
def test_clouds_and_occluders_occlude_by_first_range(
    sky: dict[str, Any], occluders: list[dict[str, Any]], cover_m: float, hidden: bool
) -> None:
    """After an approach by a quarter of the range, both targets are nearer than the first range of the cover."""
    up, range_m = math.radians(10.0), cover_m * (1.04 if hidden else 0.96)
    velocity = (0.0, cover_m / 8 * math.cos(up), cover_m / 8 * math.sin(up))
    path = {"kind": "straight", "start": (80, 60), "speed": 0.0, "range_m": range_m}
    moving = scene({"kind": "sky", **sky}, velocity, targets=[{**JET, "path": path}], occluders=occluders)
    (jet,) = Renderer(moving).scene(60)[1].targets
    assert jet.visible == pytest.approx(0.0 if hidden else 1.0, abs=0.01)
    assert jet.occluders == (("cover",) if hidden else ())
    assert jet.range_m == pytest.approx(range_m - cover_m / 4, abs=1)


def test_targets_occlude_by_present_range() -> None:
    """Also for a camera that has passed both and looks back."""
    paths = {
        name: {"kind": "straight_m", "axes": "world", "start_m": (0.0, ahead, 0.0), "velocity_m_s": (0, 0, 0)}
        for name, ahead in (("first", 600.0), ("second", 800.0))
    }
    targets = [{"id": name, "shape": {"kind": "fighter"}, "path": path} for name, path in paths.items()]
    motion = [
        {"kind": "platform", "velocity_m_s": (0.0, 500.0, 0.0)},
        {"kind": "tracks", "target": "first", "lag_s": 0.0},
    ]
    camera = {"elevation_deg": 0.0, "motion": motion}
    renderer = Renderer(scene({"kind": "sky"}, (0.0, 0.0, 0.0), camera=camera, targets=targets))
    for frame, nearer in ((0, "first"), (60, "second")):
        seen = {target.id: target for target in renderer.scene(frame)[1].targets}
        assert seen[nearer].visible == pytest.approx(1.0)
        ((other, hidden),) = [(name, each) for name, each in seen.items() if name != nearer]
        assert hidden.occluders == (nearer,), (frame, other)


def test_passed_clouds_are_not_drawn() -> None:
    clouds = [
        {"id": "near", "range_m": 500.0, **CLOUDS},
        {"id": "evolves", "range_m": 600.0, "evolve_s": 20.0, **CLOUDS},
    ]
    renderer = Renderer(scene({"kind": "sky", "clouds": clouds}, (0.0, 330.0, 0.0)))
    for name, last in (("near", 45), ("evolves", 54)):  # 11 m a frame
        assert (passed(renderer, name, last) != 1).any()
        assert (passed(renderer, name, last + 3) == 1).all()
    light, _ = renderer.scene(60)
    bare = Renderer(scene({"kind": "sky"}, (0.0, 330.0, 0.0))).scene(60)[0]
    np.testing.assert_array_equal(light, bare)


def test_ground_without_a_height_stays() -> None:
    still, moving = (Renderer(scene({"kind": "ground"}, (speed, 0.0, 0.0))) for speed in (0.0, 30.0))
    np.testing.assert_array_equal(still.scene(0)[0], moving.scene(60)[0])


@pytest.mark.parametrize(
    ("elevation_deg", "velocity", "turned"),
    [(-20.0, (1.0, 0.0, 0.0), False), (-70.0, (1.2, -3.0, -1.8), True), (-80.0, (0.3, -0.5, 0.4), False)],
)
def test_targets_on_the_ground_do_not_slide_over_it(
    elevation_deg: float, velocity: tuple[float, float, float], turned: bool
) -> None:
    """The first picture, projected through the plane 80 m below, is the last one."""
    points = [
        {
            "id": f"at_{x}",
            "shape": {"kind": "point", "area_m2": 1.0},
            "path": {"kind": "straight", "start": (x, y), "speed": 0.0, "ground_m": 80.0},
        }
        for x, y in ((60, 50), (80, 60), (110, 75))
    ]
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
    views = (renderer.now(frame).view_direction(frame) for frame in (0, 60))
    before, after = (layer_of(renderer, "ground").light(view)[1] for view in views)
    wanted = resampled(before, seen[..., 0], seen[..., 1])
    found = after[30:91, 45:116]
    assert apart(found, wanted, inside) == pytest.approx((0, 0), abs=0.05)
    assert np.corrcoef(wanted[inside], found[inside])[0, 1] > 0.98
    starts, ends = ({each.id: each.center for each in renderer.scene(frame)[1].targets} for frame in (0, 60))
    for name, (at_x, at_y) in ends.items():
        if 45 <= at_x <= 115 and 30 <= at_y <= 90:
            there = resampled(seen, np.array([[at_x - 45]]), np.array([[at_y - 30]]))
            assert there.ravel().tolist() == pytest.approx(starts[name], abs=0.1)


def test_ground_is_a_plane_at_the_nadir() -> None:
    """In a field of 74 degrees each pixel shows the texel at which its ray meets the plane 80 m below."""
    geometry = Geometry((641, 481), 2e-3, math.radians(-80))
    turned = geometry.world_rotation(np.array([0.3, math.radians(-10), 0.2]))
    columns, rows, _ = GroundPlane(geometry, 80.0, (4096, 4096)).places(Chart.at(geometry, turned), (0.0, 0.0, 0.0))
    y, x = np.mgrid[:481, :641].astype(float)
    right, down, ahead = np.moveaxis(geometry.directions(np.stack([x, y], axis=-1)) @ turned, -1, 0)
    first = math.sin(
        math.radians(80)
    )  # a texel is 2 mrad wide at the range 80 m / sin 80, and so high as seen slantwise
    across = right / down * first / 2e-3
    along = (1 / math.tan(math.radians(80)) - ahead / down) * first**2 / 2e-3
    for seen, met in ((columns, across), (rows, along)):
        np.testing.assert_allclose((seen - met + 2048) % 4096 - 2048, 0, atol=0.01)


def test_far_ground_is_averaged_over_pixels() -> None:
    """On white ground the standard deviation of pixels that cover n texels falls with sqrt(n)."""
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
    """8 m to the right shift the sea at 400 m by 20 mrad to the left, 40 px."""
    sea = {"kind": "sea", "camera_height_m": 20.0, "gusts": 0.0}
    renderer = Renderer(scene(sea, (8.0, 0.0, 0.0), camera={"elevation_deg": -3.0, "psf_px": 0.0}))
    there = renderer.now(30).view_direction(30)
    before, after = (
        renderer.layers[0].light(type(there)(0.0, there.chart, None, place))[1]
        for place in ((0.0, 0.0, 0.0), there.place)
    )
    row = round(60 + (math.atan(20 / 400) - math.radians(3.0)) / 0.5e-3)
    assert np.corrcoef(after[row, 40:81], before[row, 80:121])[0, 1] > 0.99

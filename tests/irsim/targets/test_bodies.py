"""Bodies of convex parts: projected area, light without jumps, moving parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from target_views import AWAY, BODIES, IFOV, MIDDLE, body, centroid, context, drawn, drawn_at_size, on_frame, shape

from irsim.geometry.rotations import euler
from irsim.physics.radiometry import radiance
from irsim.targets.body import Body
from irsim.types import Floats

JUMPS = {"bird": 0.01, "truck": 0.01, "boat": 0.01, "pedestrian": 0.01}
"""Largest relative jump of a body's light; that of the others is a thousandth."""
EMPTY = float(radiance("mwir", 200.0))
MOVING = [kind for kind in BODIES if body(kind).joints(0.0)]


def light(value: Body, angles: tuple[float, float, float], px: float = 8.0, ifov_rad: float = IFOV) -> float:
    """Return the light it adds to a scene of 200 K, in units of its length's square."""
    sprite = drawn_at_size(value, px, angles, 0.3, ifov_rad)
    return float((sprite.emission - sprite.alpha * EMPTY).sum()) / (px * px)


def largest_jump(function: Callable[[float], float], steps: Floats) -> float:
    """Return the largest relative jump of a function within 0.0002, by bisection of its four widest steps."""
    found = np.array([function(step) for step in steps.tolist()])
    jumps = []
    for widest in np.argsort(np.abs(np.diff(found)))[-4:].tolist():
        low, high = steps[widest : widest + 2].tolist()
        at_low, at_high = found[widest : widest + 2].tolist()
        while high - low > 2e-4:
            middle = (low + high) / 2
            at_middle = function(middle)
            if abs(at_middle - at_low) > abs(at_high - at_middle):
                high, at_high = middle, at_middle
            else:
                low, at_low = middle, at_middle
        jumps.append(abs(at_high - at_low) / at_low)
    return float(max(jumps))


@pytest.mark.parametrize("kind", BODIES)
class TestEveryBody:
    def test_area_is_that_of_sampled_hulls(self, kind: str) -> None:
        from scipy.spatial import ConvexHull

        value, where, step = body(kind), context(), 0.15
        angles = np.random.default_rng(7).uniform(-180, 180, 3)
        range_m = 45.0 * value.length_m
        sprite = drawn(value, angles.tolist(), range_m=range_m)
        turn, position = AWAY @ euler(angles), where.geometry.place(np.array(MIDDLE), range_m)
        box = sprite.box
        x, y = np.meshgrid(np.arange(box.left - 2, box.right + 2, step), np.arange(box.top - 2, box.bottom + 2, step))
        inside = np.zeros(x.shape, dtype=bool)
        joints = value.joints(0.0)
        for solid in value.solids:
            corners = np.array(solid.points)
            if solid.joint:
                corners = corners @ joints[solid.joint].rotation.T + joints[solid.joint].translation
            planes = ConvexHull(where.geometry.project(corners * value.length_m @ turn.T + position)).equations
            inside |= np.all([a * x + b * y + c <= 0 for a, b, c in planes], axis=0)
        assert sprite.cover.sum() == pytest.approx(inside.sum() * step**2, rel=1e-2)
        np.testing.assert_allclose(sprite.center, (x[inside].mean(), y[inside].mean()), atol=0.03)
        edges = [x[inside].min(), x[inside].max(), y[inside].min(), y[inside].max()]
        np.testing.assert_allclose([box.left, box.right, box.top, box.bottom], edges, atol=0.4)

    def test_each_part_has_its_emissivity(self, kind: str) -> None:
        """Drawn with one emissivity above 0 at a time, the parts add up to the whole body."""
        value = body(kind)
        keys = [key for key in type(value).model_fields if key.endswith("_emissivity")]
        parts = {solid.material.removesuffix("_k") for solid in value.solids} - {"temperature"}
        named = sorted(parts - {key.removesuffix("_emissivity") for key in keys})
        whole = {"emissivity": 0.9, **dict.fromkeys(keys, 0.6), "emissivities": dict.fromkeys(named, 0.3)}
        none = dict.fromkeys(named, 0.0)
        dark: dict[str, Any] = {"emissivity": 0.0, **dict.fromkeys(keys, 0.0), "emissivities": none}
        alone = [{**dark, key: whole[key]} for key in ("emissivity", *keys)]
        alone += [{**dark, "emissivities": {**none, name: 0.3}} for name in named]

        def emitted(values: dict[str, Any]) -> Floats:
            return drawn(body(kind, **values), (30, 10, 0)).emission

        expected = emitted(whole)
        np.testing.assert_allclose(sum(map(emitted, alone)), expected, rtol=1e-9, atol=1e-9 * expected.max())
        assert emitted(dark).max() == 0
        wrong: dict[str, Any] = {"emissivities": {"wing_tip": 0.5}}
        with pytest.raises(ValueError, match="'wing_tip' is no part whose emissivity"):
            type(value).model_validate(wrong)

    def test_multiples_of_45_degrees_leave_no_streaks(self, kind: str) -> None:
        rng = np.random.default_rng(5)
        for _ in range(20):
            angles, shift = 45.0 * rng.integers(-8, 9, 3), rng.choice([0.0, 0.5, rng.random()], 2)
            sprite = drawn(body(kind), angles.tolist(), (79.5 + shift[0], 59.5 + shift[1]), 800.0)
            assert -1e-6 < sprite.cover.min() <= sprite.cover.max() < 1 + 1e-6
            assert sprite.alpha[:, [0, -1]].max() < 1e-6

    @pytest.mark.parametrize("heading", [60.0, 250.0])
    def test_light_does_not_jump_with_attitude(self, kind: str, heading: float) -> None:
        """Through level pitch, where the depth order of parts changes."""
        value = body(kind)
        jump = largest_jump(lambda pitch: light(value, (heading, pitch, 0.0)), np.linspace(-3, 3, 31))
        assert jump < JUMPS.get(kind, 0.001)
        for yaw in (heading, heading + 95.0):
            before, after = (drawn(value, (yaw + d, 10, 20), range_m=1500) for d in (0.0, 0.001))
            np.testing.assert_allclose(after.emission, before.emission, atol=1e-3 * before.emission.max())

    @pytest.mark.parametrize("angles", [(90.0, 0.0, 0.0), (130.0, 0.05, 0.0)])
    def test_light_times_range_squared_is_constant(self, kind: str, angles: tuple[float, float, float]) -> None:
        """From a fiftieth of a pixel to thirty, through a narrow lens that makes near and far side equally large."""
        found = [light(body(kind), angles, px, 1e-5) for px in (0.02, 0.2, 0.5, 2.0, 8.0, 30.0)]
        assert found == pytest.approx([found[-2]] * len(found), rel=0.01)


@pytest.mark.parametrize(
    ("kind", "hot_k", "hidden", "shown"), [("fighter", 900.0, 1 + 1e-9, 10), ("tank", 400.0, 1.05, 2)]
)
def test_the_front_hides_the_hot_rear(kind: str, hot_k: float, hidden: float, shown: float) -> None:
    front, rear = (
        np.divide(*(drawn(shape(kind, engine_k=kelvin), (yaw, 0, 0)).emission.sum() for kelvin in (hot_k, 300.0)))
        for yaw in (180, 0)
    )
    assert front <= hidden
    assert rear > shown


def test_a_distant_body_equals_a_point_of_its_area() -> None:
    """At 0.2 px: the same light, on the same pixels within 4 % of the peak."""
    value = body("fighter", engine_k=300.0, emissivity=0.9)
    far = drawn_at_size(value, 0.2)
    range_m = value.length_m / (0.2 * IFOV)
    area = float(far.cover.sum()) * (range_m * IFOV) ** 2
    point = drawn(shape("point", area_m2=area, temperature_k=300.0, emissivity=0.9), at=far.center, range_m=range_m)
    assert point.emission.sum() == pytest.approx(far.emission.sum(), rel=1e-6)
    top = point.emission.max()
    np.testing.assert_allclose(on_frame(point, point.emission), on_frame(far, far.emission), atol=0.04 * top)


@pytest.mark.parametrize("kind", MOVING)
def test_motion_is_smooth_and_random_access(kind: str) -> None:
    value, attitude = body(kind), (70, 30, 10)
    first, later, again, soon = (drawn_at_size(value, 40.0, attitude, t) for t in (0.0, 0.11, 0.11, 0.11 + 1e-7))
    assert np.abs(on_frame(later, later.cover) - on_frame(first, first.cover)).max() > 0.1
    assert np.array_equal(again.alpha, later.alpha)
    np.testing.assert_allclose(on_frame(soon, soon.cover), on_frame(later, later.cover), atol=1e-3)
    np.testing.assert_allclose(centroid(later, later.emission), later.signal_center, atol=1e-3)


@pytest.mark.parametrize(
    ("kind", "rate", "angles", "period"),
    # The tail rotor of the helicopter, of two crossed blades, makes five quarter turns in one of the main rotor.
    [("helicopter", {"rotor_hz": 4.0}, (70, 30, 10), 1 / 16), ("pedestrian", {"stride_hz": 1.0}, (180, 0, 0), 1.0)],
)
def test_moving_parts_repeat(kind: str, rate: dict[str, float], angles: tuple[float, ...], period: float) -> None:
    first, later = (drawn_at_size(body(kind, **rate), 40.0, angles, time) for time in (0.2, 0.2 + period))
    np.testing.assert_allclose(later.cover, first.cover, atol=1e-6)

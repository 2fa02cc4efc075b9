"""Bodies of convex parts: projected area, light without jumps, moving parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from target_views import AWAY, BODIES, IFOV, MIDDLE, body, centroid, context, drawn, drawn_at_size, on_frame, shape

from irsim.motion.attitude import euler
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
    def test_its_area_is_that_of_sampled_hulls(self, kind: str) -> None:
        from scipy.spatial import ConvexHull

        value, where, step = body(kind), context(), 0.1
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

    def test_blur_keeps_the_light(self, kind: str) -> None:
        sharp, soft = (drawn(body(kind), where=context(psf_px)) for psf_px in (0.0, 1.3))
        assert soft.alpha.sum() == pytest.approx(soft.cover.sum(), rel=1e-12)
        assert soft.emission.sum() == pytest.approx(sharp.emission.sum(), rel=1e-12)
        np.testing.assert_allclose(sharp.alpha, sharp.cover, atol=1e-12)

    @settings(max_examples=30, deadline=None)
    @given(st.tuples(*[st.integers(-8, 8)] * 3), st.floats(0, 1), st.floats(0, 1))
    def test_special_attitudes_leave_no_streaks(
        self, kind: str, eighths: tuple[int, int, int], dx: float, dy: float
    ) -> None:
        sprite = drawn(body(kind), [45.0 * eighth for eighth in eighths], (79.5 + dx, 59.5 + dy), 800.0)
        assert sprite.cover.min() > -1e-6
        assert sprite.cover.max() < 1 + 1e-6
        assert sprite.alpha[:, [0, -1]].max() < 1e-6

    def test_pixels_change_smoothly_with_yaw(self, kind: str) -> None:
        for yaw in range(0, 360, 40):
            before, after = (drawn(body(kind), (yaw + d, 10, 20), range_m=1500) for d in (0.0, 0.001))
            np.testing.assert_allclose(after.alpha, before.alpha, atol=1e-3)
            np.testing.assert_allclose(after.emission, before.emission, atol=1e-3 * before.emission.max())

    @pytest.mark.parametrize("heading", [0.0, 60.0, 90.0, 250.0])
    def test_its_light_does_not_jump_with_pitch(self, kind: str, heading: float) -> None:
        """Through level, where the depth order of parts changes."""
        value = body(kind)
        jump = largest_jump(lambda pitch: light(value, (heading, pitch, 0.0)), np.linspace(-3, 3, 31))
        assert jump < JUMPS.get(kind, 0.001)

    def test_light_times_range_squared_is_constant(self, kind: str) -> None:
        """From a fiftieth of a pixel to thirty, also where edges of different parts coincide.

        Through a narrow lens, so that the near side does not grow before the far side.
        """
        for angles in [(90.0, 0.0, 0.0), (270.0, -30.0, 0.0), (0.0, 0.0, 0.0), (130.0, 0.05, 0.0)]:
            found = [light(body(kind), angles, px, 1e-5) for px in (0.02, 0.1, 0.2, 0.5, 2.0, 8.0, 30.0)]
            assert found == pytest.approx([found[-2]] * len(found), rel=0.01)


class TestFighter:
    def test_its_broadside_length(self) -> None:
        # 15 m at 2000 m and 0.5 mrad a pixel: 15 px.
        assert drawn(shape("fighter", length_m=15.0), range_m=2000).box.w == pytest.approx(15, rel=2e-3)

    @pytest.mark.parametrize(("kind", "hidden", "shown"), [("fighter", 1 + 1e-9, 10), ("tank", 1.05, 2)])
    def test_its_front_hides_its_hot_rear(self, kind: str, hidden: float, shown: float) -> None:
        values = [shape(kind, engine_k=kelvin) for kelvin in (300.0, 900.0 if kind == "fighter" else 400.0)]
        cold, hot = (drawn(value, (180, 0, 0)).emission.sum() for value in values)
        assert hot <= hidden * cold
        cold, hot = (drawn(value, (0, 0, 0)).emission.sum() for value in values)
        assert hot > shown * cold

    def test_the_signal_centre_is_at_the_hot_end(self) -> None:
        hot = drawn(shape("fighter", engine_k=900.0))
        assert hot.signal_center[0] < hot.center[0] - 5  # flies right, so its tail is on the left
        even = drawn(shape("fighter", temperature_k=310.0, engine_k=310.0), (60, 20, 30))
        np.testing.assert_allclose(even.signal_center, even.center, atol=1e-9)

    def test_near_the_lens_only_the_visible_part_is_drawn(self) -> None:
        sprite = drawn(shape("fighter"), range_m=12.0)
        assert sprite.box.w > 2000
        assert sprite.alpha.shape[1] < 200
        assert not sprite.whole

    def test_a_distant_body_equals_a_point_of_its_area(self) -> None:
        """At 0.2 px: the same light, on the same pixels within 4 % of the peak."""
        value = body("fighter", engine_k=300.0, emissivity=0.9)
        far = drawn_at_size(value, 0.2)
        range_m = value.length_m / (0.2 * IFOV)
        area = float(far.cover.sum()) * (range_m * IFOV) ** 2
        point = drawn(shape("point", area_m2=area, temperature_k=300.0, emissivity=0.9), at=far.center, range_m=range_m)
        assert point.emission.sum() == pytest.approx(far.emission.sum(), rel=1e-6)
        top = point.emission.max()
        np.testing.assert_allclose(on_frame(point, point.emission), on_frame(far, far.emission), atol=0.04 * top)


class TestMovingParts:
    @pytest.mark.parametrize("kind", MOVING)
    def test_motion_is_smooth_and_random_access(self, kind: str) -> None:
        value, attitude = body(kind), (70, 30, 10)
        first, later, again, soon = (drawn_at_size(value, 40.0, attitude, t) for t in (0.0, 0.11, 0.11, 0.11 + 1e-7))
        assert np.abs(on_frame(later, later.cover) - on_frame(first, first.cover)).max() > 0.1
        assert np.array_equal(again.alpha, later.alpha)
        np.testing.assert_allclose(on_frame(soon, soon.cover), on_frame(later, later.cover), atol=1e-3)
        for sprite in (first, later):
            np.testing.assert_allclose(centroid(sprite, sprite.emission), sprite.signal_center, atol=1e-3)

    def test_the_kinds_with_joints(self) -> None:
        assert MOVING == ["helicopter", "quadrotor", "bird", "pedestrian"]

    def test_a_rotor_repeats_after_a_quarter_turn(self) -> None:
        value = body("helicopter", rotor_hz=4.0)
        # The tail rotor, of two crossed blades, turns five quarters meanwhile.
        first, later = (drawn_at_size(value, 40.0, (70, 30, 10), time) for time in (0.3, 0.3 + 1 / 16))
        np.testing.assert_allclose(later.cover, first.cover, atol=1e-6)

    def test_a_stride_repeats_and_mirrors_after_half(self) -> None:
        value = body("pedestrian", stride_hz=1.0)
        first, half, whole = (drawn_at_size(value, 40.0, (180, 0, 0), time) for time in (0.2, 0.7, 1.2))
        np.testing.assert_allclose(whole.cover, first.cover, atol=1e-6)
        np.testing.assert_allclose(on_frame(half, half.cover)[:, ::-1], on_frame(first, first.cover), atol=5e-3)

    def test_wings_are_up_and_down_in_a_beat(self) -> None:
        value = body("bird", beat_hz=1.0, phase_deg=90.0)
        up, down = (drawn_at_size(value, 40.0, (0, 0, 0), time) for time in (0.0, 0.5))
        assert up.box.top < down.box.top - 5
        assert down.box.bottom > up.box.bottom + 5

    @pytest.mark.parametrize("kind", ["quadrotor", "helicopter"])
    @pytest.mark.parametrize("rate_hz", [25.0, 30.0, 50.0, 60.0, 100.0, 120.0])
    def test_default_rotors_do_not_alias_to_rest(self, kind: str, rate_hz: float) -> None:
        """From frame to frame a rotor turns at least 5 degrees beyond its symmetry angle."""
        angle = 360 * body(kind).model_dump()["rotor_hz"] / rate_hz % 180
        assert 5 < angle < 175

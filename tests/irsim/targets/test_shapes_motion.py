"""Bodies that move in themselves, and bodies that near from a point to thirty pixels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_shapes import AWAY, BODIES, IFOV, middle, shape

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import euler
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.targets import SHAPES, View
from irsim.targets.body import Body
from irsim.targets.parts import hinge
from irsim.types import Floats


def body(kind: str, **keys: float) -> Body:
    value = shape(kind, **keys)
    assert isinstance(value, Body)
    return value


MOVING = [kind for kind in BODIES if body(kind).joints(0.0)]


def drawn(
    value: Body,
    time: float = 0.0,
    angles: tuple[float, float, float] = (70, 30, 10),
    px: float = 40.0,
    ifov: float = IFOV,
) -> Sprite:
    """A body seen with its length about `px` pixels."""
    where = SceneContext(0, Geometry((160, 120), ifov), 30.0, "mwir", 0.6)
    place = where.geometry.place(np.array([79.5, 59.5]), value.length_m / (px * ifov))
    sprite = value.draw(View(place, AWAY @ euler(np.array(angles)), where, time))
    assert sprite is not None
    return sprite


def test_the_kinds_that_move() -> None:
    assert MOVING == ["helicopter", "quadrotor", "bird", "pedestrian"]


def test_a_hinge_turns_about_its_axis() -> None:
    # About y (right) through (1, 0, 0), a quarter turn lifts (2, 5, 0), ahead of it, to (1, 5, -1): z is down.
    turned = hinge((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), math.pi / 2)
    np.testing.assert_allclose(turned.turn @ [2.0, 5.0, 0.0] + turned.shift, [1.0, 5.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(turned.turn @ [1.0, 7.0, 0.0] + turned.shift, [1.0, 7.0, 0.0], atol=1e-12)
    both = turned @ turned
    np.testing.assert_allclose(both.turn @ [2.0, 5.0, 0.0] + both.shift, [0.0, 5.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("kind", MOVING)
class TestMotion:
    def test_it_moves_smoothly_and_any_time_stands_alone(self, kind: str) -> None:
        value = body(kind)
        first, later = drawn(value, 0.0), drawn(value, 0.11)
        assert np.abs(_frame(later.cover, later) - _frame(first.cover, first)).max() > 0.1
        again = drawn(value, 0.11)
        assert np.array_equal(again.alpha, later.alpha)
        soon = drawn(value, 0.11 + 1e-7)
        np.testing.assert_allclose(_frame(soon.cover, soon), _frame(later.cover, later), atol=1e-3)

    def test_truth_stays_the_centroid_of_its_pixels(self, kind: str) -> None:
        for time in np.linspace(0, 0.7, 12):
            sprite = drawn(body(kind), float(time))
            np.testing.assert_allclose(middle(sprite, sprite.alpha), sprite.center, atol=1e-3)
            np.testing.assert_allclose(middle(sprite, sprite.emission), sprite.signal_center, atol=1e-3)


def _frame(cells: Floats, sprite: Sprite) -> Floats:
    picture = np.zeros((120, 160))
    rows, columns = cells.shape
    picture[sprite.y0 : sprite.y0 + rows, sprite.x0 : sprite.x0 + columns] = cells
    return picture


def test_a_rotor_repeats_after_a_quarter_turn() -> None:
    value = body("helicopter", rotor_hz=4.0)
    # The tail rotor, of two crossed blades, turns five quarters meanwhile.
    first, later = drawn(value, 0.3), drawn(value, 0.3 + 1 / 16)
    np.testing.assert_allclose(later.cover, first.cover, atol=1e-6)


def test_a_person_repeats_after_a_stride_and_mirrors_after_half() -> None:
    value = body("pedestrian", stride_hz=1.0)
    ahead = (180.0, 0.0, 0.0)
    first, half, whole = (drawn(value, time, ahead) for time in (0.2, 0.7, 1.2))
    np.testing.assert_allclose(whole.cover, first.cover, atol=1e-6)
    np.testing.assert_allclose(_frame(half.cover, half)[:, ::-1], _frame(first.cover, first), atol=5e-3)


def test_wings_are_up_and_down_in_a_beat() -> None:
    value = body("bird", beat_hz=1.0, phase_deg=90.0)
    behind = (0.0, 0.0, 0.0)
    up, down = drawn(value, 0.0, behind), drawn(value, 0.5, behind)
    assert up.box.top < down.box.top - 5
    assert down.box.bottom > up.box.bottom + 5


def test_the_renderer_gives_the_time() -> None:
    scenario = Scenario.model_validate(
        {
            "frames": 5,
            "camera": {"size": (160, 120), "netd_mk": 0.0, "rate_hz": 10.0},
            "background": {"kind": "sky"},
            "targets": [
                {
                    "id": "one",
                    "shape": {"kind": "bird"},
                    "path": {"kind": "straight", "start": (80.0, 60.0), "speed": 0.0, "range_m": 60.0},
                }
            ],
        }
    )
    renderer = Renderer(scenario)
    view = renderer.courses[0].view(3, renderer.pose(3))
    assert view.time == pytest.approx(0.3)
    assert view.name == "one"


@pytest.mark.parametrize("kind", [name for name, each in SHAPES if issubclass(each, Body)])
def test_flux_is_conserved_from_a_tenth_of_a_pixel_to_thirty(kind: str) -> None:
    """Light on the pixels times range squared, the body turned broadside, as it nears from a point.

    Through a narrow lens, so that its near side does not grow before its far side: the range is 3,333
    lengths at 30 px.
    """
    value = body(kind)
    fluxes = []
    for px in np.geomspace(0.1, 30.0, 12):
        sprite = drawn(value, 0.0, (90, 0, 0), float(px), ifov=1e-5)
        empty = float(radiance("mwir", 200.0))
        fluxes.append(float((sprite.emission - sprite.alpha * empty).sum()) / px**2)
    assert np.ptp(fluxes) <= 2e-3 * np.mean(fluxes)


def test_a_far_body_and_a_point_of_its_area_are_one() -> None:
    """At 0.2 px a body gives the light of a point of its projected area, on the same pixels within 4 % of the peak."""
    value = body("fighter", engine_k=300.0, emissivity=0.9)
    far = drawn(value, 0.0, (90, 0, 0), 0.2)
    range_m = value.length_m / (0.2 * IFOV)
    area = float(far.cover.sum()) * (range_m * IFOV) ** 2
    point = shape("point", area_m2=area, temperature_k=300.0, emissivity=0.9)
    where = SceneContext(0, Geometry((160, 120), IFOV), 30.0, "mwir", 0.6)
    place = where.geometry.place(np.array(far.center), range_m)
    near = point.draw(View(place, np.eye(3), where))
    assert near is not None
    assert near.emission.sum() == pytest.approx(far.emission.sum(), rel=1e-6)
    top = near.emission.max()
    np.testing.assert_allclose(_frame(near.emission, near), _frame(far.emission, far), atol=0.04 * top)


@pytest.mark.parametrize("kind", ["quadrotor", "helicopter"])
@pytest.mark.parametrize("rate_hz", [25.0, 30.0, 50.0, 60.0, 100.0, 120.0])
def test_no_default_rotor_stands_still_at_a_usual_rate(kind: str, rate_hz: float) -> None:
    """Nor nearly so: from frame to frame it turns on by 5 degrees at least of those after which it looks alike."""
    turned = 360 * body(kind).model_dump()["rotor_hz"] / rate_hz % 180
    assert 5 < turned < 175

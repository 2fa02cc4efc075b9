"""The contract of every target shape: exact centroids and areas, determinism, switches, suggested names."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mesh_files import GIVEN
from pydantic_core import PydanticCustomError
from target_views import KINDS, centroid, context, drawn, shape, view

from irsim import loads
from irsim.backgrounds import BACKGROUNDS
from irsim.config.base import Family
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.targets import SHAPES, View

ARRAYS = ("cover", "alpha", "emission")


@pytest.mark.parametrize("kind", KINDS)
class TestEveryShape:
    def test_centroids_and_area_are_those_of_its_pixels(self, kind: str) -> None:
        """At any attitude and sub-pixel position, and at any time of moving parts."""
        rng = np.random.default_rng(1)
        value = shape(kind)
        for _ in range(6):
            angles, at = rng.uniform(-180, 180, 3).tolist(), tuple(rng.uniform(60, 62, 2).tolist())
            sprite = drawn(value, angles, at, 2000.0, float(rng.uniform(0, 1)))
            np.testing.assert_allclose(centroid(sprite, sprite.alpha), sprite.center, atol=1e-3)
            np.testing.assert_allclose(centroid(sprite, sprite.emission), sprite.signal_center, atol=1e-3)
            assert sprite.cover.sum() == pytest.approx(sprite.area, rel=1e-6)
            assert sprite.cover.min() > -1e-6
            assert sprite.cover.max() < 1 + 1e-6
            assert sprite.whole

    def test_it_follows_a_hundredth_of_a_pixel(self, kind: str) -> None:
        # Distant, so that the change of direction turns the body by a negligible angle.
        value = shape(kind)
        for x in (60.0, 60.37, 60.69):
            here, there = (drawn(value, (50, 20, 30), (x + d, 40.2), 4000.0) for d in (0.0, 0.01))
            np.testing.assert_allclose(np.subtract(there.center, here.center), [0.01, 0], atol=3e-5)

    def test_it_is_the_same_again_and_after_others(self, kind: str) -> None:
        value, other = shape(kind), shape("fighter")
        views = [view((30, 20, 10), (70.3, 50.1), 2000.0, 0.3), view((50, 0, 0), (30.0, 40.0), 900.0, 0.3)]
        alone = shape(kind).draw(views[0])
        other.draw(views[1])
        assert alone is not None
        for same in (value.draw(views[0]), value.draw(views[0])):
            assert same is not None
            assert (alone.center, alone.signal_center) == (same.center, same.signal_center)
            for name in ARRAYS:
                np.testing.assert_array_equal(getattr(alone, name), getattr(same, name))

    def test_behind_the_camera_and_at_the_edge(self, kind: str) -> None:
        value = shape(kind)
        assert value.draw(View(np.array([0.0, 0, -500]), np.eye(3), context())) is None
        inside, outside = (drawn(value, at=(x, 60), range_m=6000) for x in (3, -1))
        assert outside.area == pytest.approx(inside.area, rel=5e-3)

    def test_its_radiance_is_that_of_its_temperatures(self, kind: str) -> None:
        keys = type(shape(kind)).model_fields
        value = shape(kind, **{key: 0.8 for key in keys if key.endswith("emissivity")})
        given = {key: x for key, x in value.model_dump().items() if key.endswith("_k")}
        kelvin = [x for x in (*given.values(), *given.pop("materials_k", {}).values()) if isinstance(x, float)]
        sprite = drawn(value, (30, 10, 0), where=context(0.0))
        lit = sprite.alpha > 0.01
        glow = sprite.emission[lit] / sprite.alpha[lit]
        low, high = (0.8 * float(radiance("mwir", each)) for each in (min(kelvin), max(kelvin)))
        assert glow.min() >= low - 1e-6 * high
        assert glow.max() <= high * (1 + 1e-6)

    def test_without_removes_it_and_its_flicker(self, kind: str) -> None:
        full = scene(kind, ["it", "other"], "{kind: blink, dim: 0.2, phase: 0.7}")
        steady = scene(kind, ["it", "other"], "{kind: steady}")
        for without, expected in (("it", scene(kind, ["other"])), ("it.flicker", steady)):
            image, truth = Renderer(loads(full, overrides=[f"without=[{without}]"])).frame(2)
            same, same_truth = Renderer(loads(expected)).frame(2)
            np.testing.assert_array_equal(image.image, same.image)
            assert truth == same_truth
        assert {target.id for target in Renderer(loads(full)).frame(2)[1].targets} == {"it", "other"}


def scene(kind: str, names: list[str], flicker: str = "{kind: steady}") -> str:
    """Return a scenario with a target `it` of the kind and a point `other`."""
    keys = "".join(f", {key}: {json.dumps(value)}" for key, value in GIVEN.get(kind, {}).items())
    shapes = {"it": f"{{kind: {kind}, flicker: {flicker}{keys}}}", "other": "{kind: point}"}
    lines = "".join(
        f"  - {{id: {name}, shape: {shapes[name]}, "
        f"path: {{kind: straight, start: [{30 + 40 * (name == 'other')}, 30], range_m: 900}}}}\n"
        for name in names
    )
    return f"frames: 4\ncamera: {{size: [96, 64], netd_mk: 20}}\nbackground: {{kind: sky}}\ntargets:\n{lines}"


def message(family: Family, word: str) -> str:
    with pytest.raises(PydanticCustomError) as caught:
        family.find(word)
    return caught.value.message()


def test_an_unknown_kind_suggests_a_synonym_or_the_nearest() -> None:
    for family in (SHAPES, BACKGROUNDS):
        for word, kind in family.synonyms.items():
            assert word not in family.kinds
            assert message(family, word).endswith(f"; did you mean '{kind}'?")
    for word, kind in {"UAV": "quadrotor", "pont": "point", "sar": "car"}.items():  # 'sar' is as near to 'sam'
        assert message(SHAPES, word).endswith(f" or module:Class; did you mean '{kind}'?")
    assert message(SHAPES, "zebra").endswith(" or module:Class")

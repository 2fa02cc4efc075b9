"""Points, flares, hot spots, flicker, fainter neighbours, and requested contrast or signal-to-clutter ratio."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scene_figures import around
from target_views import AWAY, IFOV, context, drawn, shape

from irsim import loads
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import RequestedContrast, Sprite
from irsim.lint import lint
from irsim.physics.radiometry import radiance, temperature
from irsim.render.contrast import GUARD_PX, RING_PX, requested_radiance, scr
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.targets import View
from irsim.targets.flicker import FLICKERS, Flicker, Flutter
from irsim.targets.point import Flare, Point
from irsim.types import Box, Floats

OFF_AXIS = math.cos(math.atan(IFOV * math.hypot(30.3 - 79.5, 40.8 - 59.5)))
"""Cosine of the angle between the optical axis and the pixel (30.3, 40.8)."""
GROUND = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.7}


def scene(target: dict[str, Any], background: dict[str, Any] | None = None, **camera: Any) -> Scenario:
    path = {"kind": "straight", "start": (60.0, 60.0), "speed": 0.37, "range_m": 1500.0}
    return Scenario.model_validate(
        {
            "frames": 40,
            "camera": {"size": (160, 120), "netd_mk": 0.0, **camera},
            "background": background or {"kind": "sky", "horizon_k": 270.0, "zenith_k": 270.0},
            "targets": [{"id": "one", "shape": target, "path": path}],
        }
    )


class TestPoint:
    def test_its_light_is_its_share_of_a_pixel(self) -> None:
        # 0.1 m2 at 1000 m, where a pixel on the axis spans 0.5 m: phi = 0.1 / 0.25 = 0.4.
        assert drawn(shape("point", area_m2=0.1)).alpha.sum() == pytest.approx(0.4, abs=1e-8)
        sprite = drawn(shape("point", area_m2=0.1), at=(30.3, 40.8))
        assert sprite.alpha.sum() == pytest.approx(0.4 / OFF_AXIS**3, abs=1e-8)
        assert sprite.cover.sum() == pytest.approx(1.0, abs=1e-8)
        assert sprite.center == pytest.approx((30.3, 40.8))
        assert drawn(shape("point", area_m2=50.0)).alpha.max() == pytest.approx(1.0)

    def test_its_box_is_the_width_of_the_psf(self) -> None:
        box = drawn(shape("point"), where=context(8.0)).box
        assert (box.w, box.h) == pytest.approx((18.84, 18.84), rel=2e-3)  # 2.3548 * 8

    def test_without_blur_it_lights_one_pixel(self) -> None:
        sprite = drawn(shape("point", area_m2=1e-6), at=(30.3, 40.8), where=context(0.0))
        lit = np.argwhere(sprite.alpha > 1e-12)
        assert (lit + np.array([sprite.y0, sprite.x0])).tolist() == [[41, 30]]
        assert sprite.alpha.max() == pytest.approx(4e-6 / OFF_AXIS**3)

    @pytest.mark.parametrize("x", [79.5, 600.0])
    def test_off_the_axis_it_fills_more_of_a_pixel(self, x: float) -> None:
        """A pixel at an angle t off the axis spans cos^3 t of the solid angle of a pixel at the axis."""
        wide = SceneContext(0, Geometry((640, 120), 1e-3), 30.0, "mwir", 0.6)
        for kind, keys in (("point", {"area_m2": math.pi / 4}), ("hot_spot", {"size_m": (1.0, 1.0)})):
            sprite = shape(kind, **keys).draw(View(wide.geometry.place(np.array([x, 59.5]), 200.0), AWAY, wide))
            assert sprite is not None
            cosine = math.cos(math.atan((x - 319.5) * 1e-3))
            assert sprite.alpha.sum() == pytest.approx(math.pi / 4 / (200 * 1e-3) ** 2 / cosine**3, rel=0.02)


@pytest.mark.parametrize("range_m", [2000.0, 100.0])
def test_a_hot_spot_is_an_ellipse_of_its_size(range_m: float) -> None:
    # 4 m by 2 m on the axis: pi / 4 * 4 * 2 m2; a pixel spans (0.5 mrad * range)^2.
    sprite = drawn(shape("hot_spot", size_m=[4.0, 2.0]), range_m=range_m)
    assert sprite.cover.sum() == pytest.approx(math.pi * 2 / (IFOV * range_m) ** 2, rel=1e-6)
    assert (sprite.box.w, sprite.box.h) == pytest.approx((4 / (IFOV * range_m), 2 / (IFOV * range_m)), rel=1e-6)


HEAD = """
frames: 150
camera: {size: [160, 120], netd_mk: 0, psf_px: 0.8}
background: {kind: sky, horizon_k: 250, zenith_k: 250}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [40, 40], speed: 0.6, range_m: 2500}}
"""


def with_thrown(kind: str, frame: float = 20) -> str:
    path = f"{{kind: thrown, target: jet, at_frame: {frame}}}"
    return HEAD + f"  - {{id: it, shape: {{kind: {kind}}}, path: {path}}}\n"


class TestFlare:
    def test_it_rises_burns_and_fades(self) -> None:
        flare = Flare(rise_s=0.2, burn_s=2.0, fade_s=0.5)
        assert flare.intensity(0.2) == pytest.approx(1 - math.exp(-1))
        assert flare.intensity(1.9) == pytest.approx(1, abs=1e-4)
        assert flare.intensity(2.5) == pytest.approx(math.exp(-1), abs=1e-4)
        assert flare.intensity(math.inf) == 1

    @pytest.mark.parametrize(("frame", "late"), [(149, False), (149.5, True)])
    def test_a_throw_after_the_last_frame_is_warned_of(self, frame: float, late: bool) -> None:
        notices = list(lint(loads(with_thrown("flare", frame))))
        assert [notice.at for notice in notices] == [("targets", 1, "path")] * late

    @pytest.mark.parametrize(
        ("kind", "first"), [("flare", 21), ("flare, rise_s: 0", 20), ("hot_spot", 20), ("bird", 20)]
    )
    def test_ground_truth_begins_with_the_throw(self, kind: str, first: int) -> None:
        """A flare that needs time to ignite is dark in the frame of its throw."""
        renderer = Renderer(loads(with_thrown(kind)))
        present = [frame for frame in range(18, 24) if renderer.scene(frame)[1].target("it") is not None]
        assert present == list(range(first, 24))

    def test_it_falls_behind_the_jet_until_burnt_out(self) -> None:
        renderer = Renderer(loads(with_thrown("flare, burn_s: 1.0, fade_s: 0.1")))
        truths = {frame: renderer.scene(frame)[1] for frame in (21, 60, 90)}
        young, old, gone = (truths[frame].target("it") for frame in (21, 60, 90))
        jet = truths[60].target("jet")
        assert gone is None
        assert young is not None
        assert old is not None
        assert jet is not None
        assert young.cls == "decoy"
        assert old.center[1] > young.center[1] + 5
        assert old.center[0] < jet.center[0]

    def test_its_light_follows_its_intensity(self) -> None:
        lone, empty = (
            Renderer(loads(with_thrown("flare"), overrides=[f"without=[{names}]"])) for names in ("jet", "jet, it")
        )
        dark = empty.scene(0)[0]
        frames = (21, 50, 110)
        light = np.array([float((lone.scene(frame)[0].astype(float) - dark).sum()) for frame in frames])
        expected = np.array([Flare().intensity((frame - 20) / 30) for frame in frames])
        # Ranges differ by a few metres of 2,500.
        np.testing.assert_allclose(light / light[1], expected / expected[1], rtol=0.02)


def test_contrast_scales_the_difference_to_the_background() -> None:
    path = "path: {kind: follow, target: jet, offset_px: [40, 30]}"
    twin = f"  - {{id: twin, cls: decoy, shape: {{kind: fighter}}, contrast: SHARE, {path}}}\n"
    text = (HEAD + twin).replace("horizon_k: 250", "horizon_k: 250, clouds: [{}]")
    empty = Renderer(loads(text.replace("SHARE", "1.0"), overrides=["without=[twin]"])).scene(7)[0].astype(float)
    light = {share: Renderer(loads(text.replace("SHARE", share))).scene(7) for share in ("0.0", "0.5", "1.0", "1.5")}
    whole = light["1.0"][0] - empty
    for share, (picture, _) in light.items():
        np.testing.assert_allclose(picture - empty, float(share) * whole, atol=1e-5 * abs(whole).max())
    full, half = (light[share][1].target("twin") for share in ("1.0", "0.5"))
    assert full is not None
    assert half is not None
    assert full.contrast_k is not None
    assert half.contrast_k is not None
    assert 0.4 * full.contrast_k < half.contrast_k < 0.8 * full.contrast_k
    assert half.center == full.center


def flicker(kind: str, **keys: Any) -> Flicker:
    value = FLICKERS.parse({"kind": kind, **keys})
    assert isinstance(value, Flicker)
    return value


class TestFlicker:
    def test_blink_and_wave(self) -> None:
        """From 0.2 of a period of 2 s on: bright to 0.25 of it, 0.1 s later, and again from its end, at 1.6 s."""
        blink = flicker("blink", period_s=2.0, bright=0.25, dim=0.1, phase=0.2)
        factors = [blink.factor(time, 0, "a") for time in (0.0, 0.05, 0.15, 1.0, 1.55, 1.65, 2.05)]
        assert factors == [1.0, 1.0, 0.1, 0.1, 0.1, 1.0, 1.0]
        wave = flicker("wave", hz=2.0, depth=0.4, phase=0.25)
        assert [wave.factor(time, 0, "a") for time in (0.0, 0.25)] == pytest.approx([1.4, 0.6])

    def test_flutter_is_log_normal_and_continuous(self) -> None:
        value = flicker("flutter", rms=0.5, correlation_s=1.0)
        for offset in (0.0, 0.3):
            # Values three knots apart are independent: 2,000 of them.
            logs = np.log([value.factor(3.0 * k + offset, 1, "a") for k in range(2000)])
            assert logs.mean() == pytest.approx(-(0.5**2) / 2, abs=4 * 0.5 / math.sqrt(2000))
            assert logs.std() == pytest.approx(0.5, rel=4 / math.sqrt(4000))
        assert value.factor(3.0 - 1e-9, 1, "a") == pytest.approx(value.factor(3.0, 1, "a"), abs=1e-7)
        assert len({Flutter().factor(0.3, seed, name) for seed in (1, 2, 1) for name in ("a", "b")}) == 4

    @pytest.mark.parametrize("kind", ["point", "fighter"])
    def test_the_true_contrast_follows(self, kind: str) -> None:
        blink = {"kind": kind, "flicker": {"kind": "blink", "period_s": 1.0, "dim": 0.5}}
        renderer, steady = Renderer(scene(blink)), Renderer(scene({"kind": kind}))
        bright, dim, usual = (
            render.scene(frame)[1].targets[0].contrast_k
            for render, frame in ((renderer, 3), (renderer, 20), (steady, 20))
        )
        assert bright is not None
        assert dim is not None
        assert usual is not None
        half = float(temperature("mwir", radiance("mwir", 270.0 + usual) / 2))
        assert dim == pytest.approx(half - 270.0, abs=0.5)
        assert steady.scene(3)[1].targets[0].contrast_k == pytest.approx(bright)


class TestRequestedScr:
    def test_scr_by_hand(self) -> None:
        # Ring of a checkerboard 3 and 5: mean 4, sigma 1. Target of 9 in a 3 x 3 box: (9 - 4) / 1.
        rows, columns = np.indices((80, 80))
        picture = np.where((rows + columns) % 2, 3.0, 5.0)
        picture[39:42, 39:42] = 9.0
        inside, ring = around(picture.shape, Box(40, 40, 3, 3))
        assert inside.sum() == 9
        assert ring.sum() == (2 * (1 + RING_PX) + 1) ** 2 - (2 * (1 + GUARD_PX) + 1) ** 2
        assert scr(picture, Box(40, 40, 3, 3)) == pytest.approx(5.0, rel=2e-3)
        assert scr(picture, Box(40, 40, 3, 3), lambda level, box: math.sqrt(level - 1)) == pytest.approx(2.5, rel=2e-3)
        picture[:] = 1.0
        picture[40, 40] = 2.0
        assert scr(picture, Box(40, 40, 1, 1)) == math.inf
        assert math.isnan(scr(np.ones((40, 40)), Box(900, 20, 3, 3)))

    @pytest.mark.parametrize("box", [Box(2.3, 77.1, 9.2, 4.4), Box(79.2, -3, 12, 8), Box(40, 40, 70, 60)])
    def test_scr_equals_that_of_masks(self, box: Box) -> None:
        picture = np.random.default_rng(0).normal(50, 2, (80, 80)).astype(np.float32)
        inside, ring = around(picture.shape, box)
        values = picture[ring].astype(np.float64)
        mean = (inside * picture).sum() / inside.sum()
        assert scr(picture, box) == pytest.approx((mean - values.mean()) / values.std(), rel=1e-5)

    @pytest.mark.parametrize("requested", [-2.0, 10.0])
    @pytest.mark.parametrize("camera", [{}, {"netd_mk": 80.0}, {"preset": "cooled_mwir"}, {"preset": "uncooled_lwir"}])
    def test_the_true_scr_is_the_requested_one(self, requested: float, camera: dict[str, Any]) -> None:
        renderer = Renderer(scene({"kind": "point", "area_m2": 1.5, "scr": requested}, GROUND, **camera))
        for index in (0, 11):
            light, truth = renderer.scene(index)
            assert truth.targets[0].scr == pytest.approx(requested, rel=0.05)
            if not camera:  # without noise the picture has it exactly
                assert scr(light, truth.targets[0].box) == pytest.approx(requested, rel=0.01)

    @pytest.mark.parametrize("dtype", [np.float32, np.float64])
    def test_drawing_and_truth_use_the_same_ring(self, dtype: type) -> None:
        """Also for boxes whose ring ends on a pixel's middle but for rounding."""
        generator = np.random.default_rng(3)
        light: Floats = generator.uniform(1, 9, (100, 100)).astype(dtype)
        for side in generator.uniform(1, 4, 50).tolist():
            box = Box(70 - RING_PX - side / 2, 70 - GUARD_PX - side / 2, side, side)
            x0, y0, alpha = int(box.cx) - 2, int(box.cy) - 2, np.full((6, 6), 0.5)
            center = (box.cx, box.cy)
            sprite = Sprite(x0, y0, alpha, alpha, alpha, center, center, box, 1.0, 1.0, RequestedContrast(scr=3.0))
            own = requested_radiance(sprite, light, "mwir")
            assert own is not None
            patch = (slice(y0, y0 + 6), slice(x0, x0 + 6))
            picture = light.copy()
            picture[patch] = picture[patch] * (1 - alpha) + own * alpha
            assert scr(picture, box) == pytest.approx(3.0, rel=1e-6)

    def test_an_occluder_leaves_the_true_scr(self) -> None:
        bar = {"kind": "bar", "center_px": (60.0, 60.0), "size_px": (20.0, 20.0), "range_m": 500.0}
        bare = scene({"kind": "fighter"}, {"kind": "ground"}, netd_mk=40.0)
        hidden = Scenario.model_validate({**bare.model_dump(), "background": bare.background, "occluders": [bar]})
        (before,), (after,) = (Renderer(each).scene(0)[1].targets for each in (bare, hidden))
        assert after.visible == pytest.approx(0, abs=0.01)
        assert after.scr == before.scr
        outside = bare.model_dump()
        outside["targets"][0]["path"]["start"] = (-500.0, 60.0)
        assert Renderer(Scenario.model_validate(outside)).scene(0)[1].targets[0].scr is None


class TestRequestedContrast:
    @pytest.mark.parametrize("contrast_k", [5.0, -8.0])
    def test_the_true_contrast_is_the_requested_one(self, contrast_k: float) -> None:
        light, truth = Renderer(scene({"kind": "point", "area_m2": 40.0, "contrast_k": contrast_k})).scene(5)
        assert truth.targets[0].contrast_k == pytest.approx(contrast_k, abs=0.01)
        # 40 m2 cover 71 pixels: in their middle the picture shows the target's own temperature.
        kelvin = temperature("mwir", light)
        assert float(kelvin.max() if contrast_k > 0 else kelvin.min()) == pytest.approx(270 + contrast_k, abs=0.02)

    def test_flicker_scales_it(self) -> None:
        blink = {"kind": "point", "area_m2": 2.0, "contrast_k": 5.0, "flicker": {"kind": "blink", "dim": 0.0}}
        renderer = Renderer(scene(blink))
        assert renderer.scene(3)[1].targets[0].contrast_k == pytest.approx(5.0, abs=0.01)
        assert renderer.scene(20)[1].targets[0].contrast_k == pytest.approx(0.0, abs=0.01)

    def test_two_brightnesses_are_refused(self) -> None:
        with pytest.raises(ValidationError, match="contrast_k and scr are both set"):
            Point(contrast_k=5.0, scr=4.0)
        assert requested_radiance(drawn(shape("point")), np.ones((120, 160)), "mwir") is None

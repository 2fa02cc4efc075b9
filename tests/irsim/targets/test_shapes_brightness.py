"""Flicker, and points of a wanted contrast or signal-to-clutter ratio."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scene_figures import around

from irsim.geometry.sprite import RequestedContrast, Sprite
from irsim.physics.radiometry import radiance, slope, temperature
from irsim.render.contrast import GUARD_PX, RING_PX, asked_light, scr
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.targets.flicker import FLICKERS, Flicker, Flutter
from irsim.targets.point import Point
from irsim.types import Box, Floats


def flicker(kind: str, **keys: Any) -> Flicker:
    value = FLICKERS.parse({"kind": kind, **keys})
    assert isinstance(value, Flicker)
    return value


def scene(shape: dict[str, Any], background: dict[str, Any] | None = None, **camera: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "frames": 40,
            "camera": {"size": (160, 120), "netd_mk": 0.0, **camera},
            "background": background or {"kind": "sky", "horizon_k": 270.0, "zenith_k": 270.0},
            "targets": [
                {
                    "id": "one",
                    "shape": shape,
                    "path": {"kind": "straight", "start": (60.0, 60.0), "speed": 0.37, "range_m": 1500.0},
                }
            ],
        }
    )


class TestFlicker:
    def test_blink_is_bright_for_its_share_of_the_period(self) -> None:
        value = flicker("blink", period_s=2.0, bright=0.25, dim=0.1)
        times = np.arange(0.005, 20, 0.01)
        factors = [value.factor(float(time), 0, "a") for time in times]
        assert np.mean(np.array(factors) == 1.0) == pytest.approx(0.25, abs=1e-9)
        assert set(factors) == {1.0, 0.1}

    def test_a_phase_is_where_in_its_period_a_blink_begins(self) -> None:
        """From 0.2 of a period of 2 s on: bright to 0.25 of it, 0.1 s later, and again from its end, at 1.6 s."""
        value = flicker("blink", period_s=2.0, bright=0.25, dim=0.1, phase=0.2)
        factors = [value.factor(time, 0, "a") for time in (0.0, 0.05, 0.15, 1.0, 1.55, 1.65, 2.05)]
        assert factors == [1.0, 1.0, 0.1, 0.1, 0.1, 1.0, 1.0]

    def test_wave_is_a_sine(self) -> None:
        value = flicker("wave", hz=2.0, depth=0.4, phase=0.25)
        assert value.factor(0.0, 0, "a") == pytest.approx(1.4)
        assert value.factor(0.25, 0, "a") == pytest.approx(0.6)

    def test_flutter_is_log_normal_at_all_times_and_continuous(self) -> None:
        value = flicker("flutter", rms=0.5, correlation_s=1.0)
        for offset in (0.0, 0.3, 0.5):
            # Three knots apart values are independent: 4,000 of them give mean and sigma within 5 %.
            logs = np.log([value.factor(3.0 * k + offset, 1, "a") for k in range(4000)])
            assert logs.mean() == pytest.approx(-(0.5**2) / 2, abs=4 * 0.5 / math.sqrt(4000))
            assert logs.std() == pytest.approx(0.5, rel=4 / math.sqrt(8000))
        assert value.factor(3.0 - 1e-9, 1, "a") == pytest.approx(value.factor(3.0, 1, "a"), abs=1e-7)

    def test_flutter_is_addressed_by_seed_and_name(self) -> None:
        value = Flutter()
        assert value.factor(0.3, 1, "a") == value.factor(0.3, 1, "a")
        assert len({value.factor(0.3, seed, name) for seed in (1, 2) for name in ("a", "b")}) == 4

    @pytest.mark.parametrize("kind", ["point", "fighter"])
    def test_truth_s_contrast_follows(self, kind: str) -> None:
        shape = {"kind": kind, "flicker": {"kind": "blink", "period_s": 1.0, "dim": 0.5}}
        renderer, steady = Renderer(scene(shape)), Renderer(scene({"kind": kind}))
        bright, dim, usual = (
            render.scene(frame)[1].targets[0].contrast_k
            for render, frame in ((renderer, 3), (renderer, 20), (steady, 20))
        )
        assert bright is not None
        assert dim is not None
        assert usual is not None
        own = radiance("mwir", 270.0 + usual)
        assert float(dim) == pytest.approx(float(temperature("mwir", own / 2)) - 270.0, abs=0.5)
        assert steady.scene(3)[1].targets[0].contrast_k == pytest.approx(bright)


class TestScr:
    def test_by_hand(self) -> None:
        # Ring of a checkerboard 3 and 5: mean 4, sigma 1. Target of 9 in a 3 x 3 box: (9 - 4) / 1.
        rows, columns = np.indices((80, 80))
        picture = np.where((rows + columns) % 2, 3.0, 5.0)
        picture[39:42, 39:42] = 9.0
        inside, ring = around(picture.shape, Box(40, 40, 3, 3))
        assert inside.sum() == 9
        # Rings count pixel centres within half the box and their reach: 43 by 43 less 11 by 11.
        assert ring.sum() == (2 * (1 + RING_PX) + 1) ** 2 - (2 * (1 + GUARD_PX) + 1) ** 2
        assert scr(picture, Box(40, 40, 3, 3)) == pytest.approx(5.0, rel=2e-3)
        assert scr(picture, Box(40, 40, 3, 3), lambda level, box: math.sqrt(level - 1)) == pytest.approx(2.5, rel=2e-3)

    def test_in_an_even_picture_it_is_infinite(self) -> None:
        picture = np.ones((80, 80))
        picture[40, 40] = 2
        assert scr(picture, Box(40, 40, 1, 1)) == math.inf

    @pytest.mark.parametrize(
        "box", [Box(40, 30, 3, 3), Box(2.3, 77.1, 9.2, 4.4), Box(79.2, -3, 12, 8), Box(40, 40, 70, 60)]
    )
    def test_it_is_that_of_masks(self, box: Box) -> None:
        picture = np.random.default_rng(0).normal(50, 2, (80, 80)).astype(np.float32)
        inside, ring = around(picture.shape, box)
        values = picture[ring].astype(np.float64)
        mean = (inside * picture).sum() / inside.sum()
        assert scr(picture, box) == pytest.approx((mean - values.mean()) / values.std(), rel=1e-5)

    @pytest.mark.parametrize("wanted", [-2.0, 3.0, 10.0])
    @pytest.mark.parametrize("camera", [{}, {"netd_mk": 80.0}, {"preset": "cooled_mwir"}, {"preset": "uncooled_lwir"}])
    def test_truth_says_what_was_asked_for(self, wanted: float, camera: dict[str, Any]) -> None:
        background = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.7}
        renderer = Renderer(scene({"kind": "point", "area_m2": 1.5, "scr": wanted}, background, **camera))
        for index in (0, 11, 30):
            assert renderer.scene(index)[1].targets[0].scr == pytest.approx(wanted, rel=0.05)

    @pytest.mark.parametrize("dtype", [np.float32, np.float64])
    def test_truth_has_the_same_ring_where_it_ends_on_a_pixel(self, dtype: type) -> None:
        """Sides of boxes that add up to a pixel's middle but for rounding."""
        generator = np.random.default_rng(3)
        light: Floats = generator.uniform(1, 9, (100, 100)).astype(dtype)
        for side in generator.uniform(1, 4, 200).tolist():
            box = Box(70 - RING_PX - side / 2, 70 - GUARD_PX - side / 2, side, side)
            x0, y0, alpha = int(box.cx) - 2, int(box.cy) - 2, np.full((6, 6), 0.5)
            center = (box.cx, box.cy)
            wanted = RequestedContrast(scr=3.0)
            sprite = Sprite(x0, y0, alpha, alpha, alpha, center, center, box, 1.0, 1.0, wanted)
            own = asked_light(sprite, light, "mwir")
            assert own is not None
            drawn = light.copy()
            patch = (slice(y0, y0 + 6), slice(x0, x0 + 6))
            drawn[patch] = drawn[patch] * (1 - alpha) + own * alpha
            assert scr(drawn, box) == pytest.approx(3.0, rel=1e-6)

    def test_what_hides_a_target_changes_nothing_of_its_own(self) -> None:
        bar = {"kind": "bar", "center_px": (60.0, 60.0), "size_px": (20.0, 20.0), "range_m": 500.0}
        bare = scene({"kind": "fighter"}, {"kind": "ground"}, netd_mk=40.0)
        hidden = Scenario.model_validate({**bare.model_dump(), "background": bare.background, "occluders": [bar]})
        (before,), (after,) = (Renderer(each).scene(0)[1].targets for each in (bare, hidden))
        assert after.visible == pytest.approx(0, abs=0.01)
        assert after.scr == before.scr

    def test_out_of_the_picture_there_is_none(self) -> None:
        far = scene({"kind": "fighter"}, {"kind": "ground"}).model_dump()
        far["targets"][0]["path"]["start"] = (-500.0, 60.0)
        assert Renderer(Scenario.model_validate(far)).scene(0)[1].targets[0].scr is None

    def test_outside_there_is_none(self) -> None:
        assert math.isnan(scr(np.ones((40, 40)), Box(900, 20, 3, 3)))

    @pytest.mark.parametrize("wanted", [6.0, 20.0, -3.0])
    def test_a_wanted_scr_is_measured_in_noisy_frames(self, wanted: float) -> None:
        background = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.1}
        scenario = scene(
            {"kind": "point", "area_m2": 4.0, "scr": wanted}, background, netd_mk=100.0, range_k=(270.0, 320.0), bits=16
        )
        renderer = Renderer(scenario)
        found = []
        for index in range(0, 40, 2):
            (target,) = renderer.scene(index)[1].targets
            light = _light(renderer, index)
            found.append(scr(light, target.box))
        # The figure itself scatters by the noise on the target's few pixels, sigma about 1 / sqrt(2.4).
        assert np.mean(found) == pytest.approx(wanted, abs=0.05 * abs(wanted) + 3 * 0.65 / math.sqrt(20))

    @pytest.mark.parametrize("wanted", [4.0, 12.0])
    def test_without_noise_it_is_exact(self, wanted: float) -> None:
        background = {"kind": "ground", "mean_k": 290.0, "spread_k": 1.0}
        renderer = Renderer(scene({"kind": "point", "scr": wanted}, background))
        for index in (0, 7, 23):
            light, truth = renderer.scene(index)
            assert scr(light, truth.targets[0].box) == pytest.approx(wanted, rel=0.01)


def _light(renderer: Renderer, index: int) -> Any:
    """Radiance with white noise of the camera's NETD at 300 K."""
    light, _ = renderer.scene(index)
    camera = renderer.scenario.camera
    sigma = camera.netd_mk * 1e-3 * slope(camera.band, 300.0)
    return light + sigma * np.random.default_rng(index).standard_normal(light.shape)


class TestContrast:
    @pytest.mark.parametrize("contrast_k", [5.0, -8.0])
    def test_truth_has_the_contrast_asked_for(self, contrast_k: float) -> None:
        renderer = Renderer(scene({"kind": "point", "area_m2": 40.0, "contrast_k": contrast_k}))
        light, truth = renderer.scene(5)
        assert truth.targets[0].contrast_k == pytest.approx(contrast_k, abs=0.01)
        empty = float(radiance("mwir", 270.0))
        # 40 m2 are 71 pixels: in their middle the picture shows the target's own temperature.
        assert float(temperature("mwir", float(np.max(np.abs(light - empty))) * np.sign(contrast_k) + empty)) == (
            pytest.approx(270.0 + contrast_k, abs=0.02)
        )

    def test_flicker_scales_it(self) -> None:
        shape = {"kind": "point", "area_m2": 2.0, "contrast_k": 5.0, "flicker": {"kind": "blink", "dim": 0.0}}
        renderer = Renderer(scene(shape))
        assert renderer.scene(3)[1].targets[0].contrast_k == pytest.approx(5.0, abs=0.01)
        assert renderer.scene(20)[1].targets[0].contrast_k == pytest.approx(0.0, abs=0.01)

    def test_what_asks_for_nothing_gets_no_light(self) -> None:
        from irsim.targets.base import View

        scenario = scene({"kind": "point"})
        shape = scenario.targets[0].shape
        sprite = shape.draw(View(np.array([0.0, 0.0, 1000.0]), np.eye(3), scenario.context))
        assert sprite is not None
        assert asked_light(sprite, np.ones((120, 160)), "mwir") is None

    def test_both_at_once_are_refused(self) -> None:
        with pytest.raises(ValidationError, match="contrast_k and scr stand together"):
            Point(contrast_k=5.0, scr=4.0)

"""Points, flares, hot spots, flicker, and requested contrast or signal-to-clutter ratio."""

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
from irsim.physics.radiometry import temperature
from irsim.render.contrast import GUARD_PX, RING_PX, scr
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.targets import View
from irsim.targets.flicker import FLICKERS, Flicker
from irsim.targets.point import Flare, Point
from irsim.types import Box

OFF_AXIS = math.cos(math.atan(IFOV * math.hypot(30.3 - 79.5, 40.8 - 59.5)))
"""Cosine of the angle between the optical axis and the pixel (30.3, 40.8)."""


def scene(target: dict[str, Any], background: dict[str, Any] | None = None, **camera: Any) -> Scenario:
    path = {"kind": "straight", "start": (60.0, 60.0), "speed": 0.37, "range_m": 1500.0}
    return Scenario.model_validate(
        {
            "frames": 40,
            "camera": {"size": (120, 120), "netd_mk": 0.0, **camera},
            "background": background or {"kind": "sky", "horizon_k": 270.0, "zenith_k": 270.0},
            "targets": [{"id": "one", "shape": target, "path": path}],
        }
    )


def test_the_light_of_a_point_is_its_share_of_a_pixel() -> None:
    # 0.1 m2 at 1000 m, where a pixel on the axis spans 0.5 m: phi = 0.1 / 0.25 = 0.4.
    assert drawn(shape("point", area_m2=0.1)).alpha.sum() == pytest.approx(0.4, abs=1e-8)
    sprite = drawn(shape("point", area_m2=0.1), at=(30.3, 40.8))
    assert sprite.alpha.sum() == pytest.approx(0.4 / OFF_AXIS**3, abs=1e-8)
    assert sprite.cover.sum() == pytest.approx(1.0, abs=1e-8)
    assert sprite.center == pytest.approx((30.3, 40.8))
    assert drawn(shape("point", area_m2=50.0)).alpha.max() == pytest.approx(1.0)
    sharp = drawn(shape("point", area_m2=1e-6), at=(30.3, 40.8), where=context(0.0))
    assert (np.argwhere(sharp.alpha > 1e-12) + np.array([sharp.y0, sharp.x0])).tolist() == [[41, 30]]
    assert sharp.alpha.max() == pytest.approx(4e-6 / OFF_AXIS**3)
    box = drawn(shape("point"), where=context(8.0)).box
    assert (box.w, box.h) == pytest.approx((18.84, 18.84), rel=2e-3)  # 2.3548 * 8


@pytest.mark.parametrize("x", [79.5, 600.0])
@pytest.mark.parametrize(("kind", "keys"), [("point", {"area_m2": math.pi / 4}), ("hot_spot", {"size_m": (1.0, 1.0)})])
def test_off_the_axis_targets_fill_more_of_a_pixel(kind: str, keys: dict[str, Any], x: float) -> None:
    """A pixel at an angle t off the axis spans cos^3 t of the solid angle of a pixel at the axis."""
    wide = SceneContext(0, Geometry((640, 120), 1e-3), 30.0, "mwir", 0.6)
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


@pytest.mark.parametrize(("kind", "first"), [("flare", 21), ("flare, rise_s: 0", 20), ("bird", 20)])
def test_ground_truth_begins_with_the_throw(kind: str, first: int) -> None:
    """A flare that needs time to ignite is dark in the frame of its throw."""
    renderer = Renderer(loads(with_thrown(kind)))
    present = [frame for frame in range(18, 24) if renderer.scene(frame)[1].target("it") is not None]
    assert present == list(range(first, 24))


def test_a_flare_rises_burns_fades_and_falls_behind() -> None:
    flare = Flare(rise_s=0.2, burn_s=2.0, fade_s=0.5)
    found = [flare.intensity(age_s) for age_s in (0.2, 1.9, 2.5, math.inf)]
    assert found == pytest.approx([1 - math.exp(-1), 1, math.exp(-1), 1], abs=1e-4)
    text = with_thrown("flare, burn_s: 1.0, fade_s: 0.1")
    renderer, empty = Renderer(loads(text)), Renderer(loads(text, overrides=["without=[it]"]))
    frames = {frame: renderer.scene(frame) for frame in (21, 30, 50, 90)}
    young, *_, old, gone = (truth.target("it") for _, truth in frames.values())
    jet = frames[50][1].target("jet")
    assert gone is None
    assert jet is not None
    assert young is not None
    assert old is not None
    assert young.cls == "decoy"
    assert old.center[1] > young.center[1] + 5
    assert old.center[0] < jet.center[0]
    light = [float((frames[frame][0].astype(float) - empty.scene(frame)[0]).sum()) for frame in (30, 50)]
    expected = [Flare(burn_s=1.0, fade_s=0.1).intensity((frame - 20) / 30) for frame in (30, 50)]
    assert light[1] / light[0] == pytest.approx(expected[1] / expected[0], rel=0.05)


def test_contrast_scales_the_difference_to_the_background() -> None:
    path = "path: {kind: follow, target: jet, offset_px: [40, 30]}"
    twin = f"  - {{id: twin, cls: decoy, shape: {{kind: fighter}}, contrast: SHARE, {path}}}\n"
    text = (HEAD + twin).replace("horizon_k: 250", "horizon_k: 250, clouds: [{}]")
    shares = ("0.0", "0.5", "1.0", "1.5")
    light, truths = zip(*(Renderer(loads(text.replace("SHARE", share))).scene(7) for share in shares), strict=True)
    whole = light[2] - light[0]
    for share, picture in zip(shares, light, strict=True):
        np.testing.assert_allclose(picture - light[0], float(share) * whole, atol=1e-5 * abs(whole).max())
    half, full = (truth.target("twin") for truth in truths[1:3])
    assert 0.4 * full.contrast_k < half.contrast_k < 0.8 * full.contrast_k
    assert half.center == full.center


def flicker(kind: str, **keys: Any) -> Flicker:
    value = FLICKERS.parse({"kind": kind, **keys})
    assert isinstance(value, Flicker)
    return value


def test_blink_and_wave() -> None:
    """From 0.2 of a period of 2 s on: bright to 0.25 of it, 0.1 s later, and again from its end, at 1.6 s."""
    blink = flicker("blink", period_s=2.0, bright=0.25, dim=0.1, phase=0.2)
    factors = [blink.factor(time, 0, "a") for time in (0.0, 0.05, 0.15, 1.0, 1.55, 1.65, 2.05)]
    assert factors == [1.0, 1.0, 0.1, 0.1, 0.1, 1.0, 1.0]
    wave = flicker("wave", hz=2.0, depth=0.4, phase=0.25)
    assert [wave.factor(time, 0, "a") for time in (0.0, 0.25)] == pytest.approx([1.4, 0.6])


def test_flutter_is_log_normal_and_continuous() -> None:
    value = flicker("flutter", rms=0.5, correlation_s=1.0)
    # Values three knots apart are independent: 1,000 of them.
    logs = np.log([value.factor(3.0 * k + 0.3, 1, "a") for k in range(1000)])
    assert logs.mean() == pytest.approx(-(0.5**2) / 2, abs=4 * 0.5 / math.sqrt(1000))
    assert logs.std() == pytest.approx(0.5, rel=4 / math.sqrt(2000))
    assert value.factor(3.0 - 1e-9, 1, "a") == pytest.approx(value.factor(3.0, 1, "a"), abs=1e-7)
    assert len({value.factor(0.3, seed, name) for seed in (1, 2, 1) for name in ("a", "b")}) == 4


def contrast_k(renderer: Renderer, frame: int) -> float:
    found = renderer.scene(frame)[1].targets[0].contrast_k
    assert found is not None
    return found


def test_flicker_changes_the_true_contrast() -> None:
    blink = {"flicker": {"kind": "blink", "period_s": 1.0, "dim": 0.0}}
    for given, rel in (({"kind": "fighter"}, 1e-9), ({"kind": "point", "area_m2": 2.0, "contrast_k": 5.0}, 2e-3)):
        renderer, steady = Renderer(scene({**given, **blink})), Renderer(scene(given))
        assert contrast_k(renderer, 3) == pytest.approx(contrast_k(steady, 3), rel=rel)
        assert contrast_k(renderer, 20) < 0.01


def test_scr_by_hand() -> None:
    # Ring of a checkerboard 3 and 5: mean 4, sigma 1. Target of 9 in a 3 x 3 box: (9 - 4) / 1.
    rows, columns = np.indices((80, 80))
    picture = np.where((rows + columns) % 2, 3.0, 5.0)
    picture[39:42, 39:42] = 9.0
    inside, ring = around(picture.shape, Box(40, 40, 3, 3))
    assert inside.sum() == 9
    assert ring.sum() == (2 * (1 + RING_PX) + 1) ** 2 - (2 * (1 + GUARD_PX) + 1) ** 2
    assert scr(picture, Box(40, 40, 3, 3)) == pytest.approx(5.0, rel=2e-3)
    assert scr(picture, Box(40, 40, 3, 3), lambda level, box: math.sqrt(level - 1)) == pytest.approx(2.5, rel=2e-3)
    assert scr(np.where(inside > 0, 2.0, 1.0), Box(40, 40, 1, 1)) == math.inf
    assert math.isnan(scr(np.ones((40, 40)), Box(900, 20, 3, 3)))


@pytest.mark.parametrize("camera", [{}, {"preset": "cooled_mwir"}, {"preset": "uncooled_lwir"}])
@pytest.mark.parametrize("requested", [-2.0, 10.0])
def test_the_true_scr_is_the_requested_one(requested: float, camera: dict[str, Any]) -> None:
    ground = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.7}
    renderer = Renderer(scene({"kind": "point", "area_m2": 1.5, "scr": requested}, ground, **camera))
    light, truth = renderer.scene(11)
    assert truth.targets[0].scr == pytest.approx(requested, rel=0.05)
    if not camera:  # without noise the picture has it exactly
        assert scr(light, truth.targets[0].box) == pytest.approx(requested, rel=0.01)


def test_an_occluder_leaves_the_true_scr() -> None:
    bar = {"kind": "bar", "center_px": (60.0, 60.0), "size_px": (20.0, 20.0), "range_m": 500.0}
    bare = scene({"kind": "fighter"}, {"kind": "ground"}, netd_mk=40.0)
    hidden = Scenario.model_validate({**bare.model_dump(), "background": bare.background, "occluders": [bar]})
    (before,), (after,) = (Renderer(each).scene(0)[1].targets for each in (bare, hidden))
    assert after.visible == pytest.approx(0, abs=0.01)
    assert after.scr == before.scr


@pytest.mark.parametrize("requested_k", [5.0, -8.0])
def test_the_true_contrast_is_the_requested_one(requested_k: float) -> None:
    light, truth = Renderer(scene({"kind": "point", "area_m2": 40.0, "contrast_k": requested_k})).scene(5)
    assert truth.targets[0].contrast_k == pytest.approx(requested_k, abs=0.01)
    # 40 m2 cover 71 pixels: in their middle the picture shows the target's own temperature.
    kelvin = temperature("mwir", light)
    assert float(kelvin.max() if requested_k > 0 else kelvin.min()) == pytest.approx(270 + requested_k, abs=0.02)
    with pytest.raises(ValidationError, match="contrast_k and scr are both set"):
        Point(contrast_k=5.0, scr=4.0)

"""Trees: gapless core and ragged rim, trunk, several crowns, placement, and temperatures of the hour."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from target_views import centroid

from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.lint import lint
from irsim.occluders import OCCLUDERS
from irsim.occluders.base import required
from irsim.occluders.tree import Tree
from irsim.physics.radiometry import temperature
from irsim.scenario.loader import loads
from irsim.types import Box, Floats

CONTEXT = SceneContext(0, Geometry((320, 240), 5e-4), 30.0, "lwir", 0.6)
INTENT: dict[str, Any] = {"foot_px": None, "height_px": None, "crown_px": None, "hides": "car", "frames": (0, 9)}
SMALL = Box(200.0, 60.0, 16.0, 12.0)
"""A window that only a small crown on a long trunk covers."""


def tree(**keys: Any) -> Tree:
    given = {"foot_px": (160.0, 220.0), "height_px": 180.0, "crown_px": (120.0, 130.0), "range_m": 90.0, "id": "oak"}
    value = OCCLUDERS.parse({"kind": "tree", **given, **keys})
    assert isinstance(value, Tree)
    return value


def placed_over(window: Box, seed: int = 0, **keys: Any) -> Tree:
    return tree(**INTENT, **keys).covering(window, 1.0, replace(CONTEXT, seed=seed))


def drawn(value: Tree, pose: CameraPose | None = None, seed: int = 0) -> Sprite:
    sprite = value.draw(pose or CameraPose.first(replace(CONTEXT, seed=seed)))
    assert sprite is not None
    return sprite


@pytest.mark.parametrize(("seed", "window"), [(0, Box(150.3, 60.2, 30.0, 12.0)), (3, Box(90.7, 70.0, 9.0, 33.0))])
def test_a_placed_tree_hides_its_window_and_little_more(seed: int, window: Box) -> None:
    # With the margin of intents: the optics blur gaps beyond it by 0.6 px.
    sprite = drawn(placed_over(Box(window.cx, window.cy, window.w + 2, window.h + 2), seed), seed=seed)
    columns = slice(math.ceil(window.left + 0.5) - sprite.x0, math.floor(window.right + 0.5) - sprite.x0)
    rows = slice(math.ceil(window.top + 0.5) - sprite.y0, math.floor(window.bottom + 0.5) - sprite.y0)
    assert sprite.cover[rows, columns].min() == pytest.approx(1, abs=1e-3)
    # The core of a bare crown, 0.6 sin 60 of its width, spans the window; a leafy crown is smaller.
    for leaves, most in ((0.0, 1.0), (0.8, 0.9)):
        wide = required(placed_over(window, seed, leaves=leaves).crown_px)[0]
        assert wide * 0.6 * math.sin(math.radians(60)) / window.w < most


@pytest.mark.parametrize("seed", [0, 1])
def test_the_rim_is_ragged_and_the_core_gapless(seed: int) -> None:
    sprite = drawn(tree(), seed=seed)
    rows, columns = np.indices(sprite.cover.shape)
    x, y = columns + sprite.x0, rows + sprite.y0
    radius = np.hypot((x - 160) / 60, (y - (220 - 180 + 65)) / 65)
    assert sprite.cover[radius < 0.57].min() == pytest.approx(1, abs=1e-6)
    rim = sprite.cover[(radius > 0.8) & (radius < 0.95)]
    assert 0.2 < rim.mean() < 0.95
    assert (rim < 0.05).mean() > 0.02
    assert sprite.cover[(radius > 1.35) & (y < 150)].max(initial=0.0) == 0
    assert drawn(tree(leaves=0.0), seed=seed).cover.sum() < 0.9 * sprite.cover.sum()


def test_its_trunk_is_warm_and_stands_on_its_foot() -> None:
    sprite = drawn(tree(trunk_k=300.0, temperature_k=285.0, spread_k=0.0, emissivity=1.0))
    # The crown ends 50 px above the foot, where the trunk is 120 * 0.065 px wide and then 1.35 times that.
    low = sprite.cover[217 - sprite.y0]
    assert low.sum() == pytest.approx(120 * 0.065 * 1.35, rel=0.05)
    x = np.arange(len(low)) + sprite.x0
    assert (low * x).sum() / low.sum() == pytest.approx(160, abs=1e-6)
    assert sprite.box.bottom == pytest.approx(220)
    for row, kelvin in ((200, 300), (105, 285)):
        found = temperature("lwir", sprite.emission[row - sprite.y0, 160 - sprite.x0])
        assert found == pytest.approx(kelvin, abs=0.01)


def test_leaves_and_trunk_vary_in_temperature() -> None:
    sprite = drawn(tree(temperature_k=290.0, spread_k=2.0, trunk_k=290.0, emissivity=1.0))
    kelvin = temperature("lwir", sprite.emission[sprite.alpha > 0.999])
    # Only the middle counts here, blurred by the optics: less varied than all leaves.
    assert kelvin.mean() == pytest.approx(290, abs=0.6)
    assert 1.0 < kelvin.std() < 2.1
    sprite = drawn(tree(trunk_k=300.0, temperature_k=285.0, spread_k=1.0, emissivity=1.0, crown_px=(200.0, 130.0)))
    rows, columns = slice(180 - sprite.y0, 216 - sprite.y0), slice(156 - sprite.x0, 165 - sprite.x0)
    kelvin = temperature("lwir", sprite.emission[rows, columns])
    assert kelvin.mean() == pytest.approx(300, abs=0.5)
    assert np.subtract(*kelvin.mean(axis=0)[[0, -1]]) > 0.5  # lit from the left


@pytest.mark.parametrize("crown", [(9.0, 10.0), (120.0, 130.0)])
def test_it_follows_a_sub_pixel_shift(crown: tuple[float, float]) -> None:
    def at(x: float, y: float) -> tuple[float, Floats]:
        sprite = drawn(tree(crown_px=crown, height_px=crown[1] * 1.4, foot_px=(x, y)))
        return sprite.cover.sum(), centroid(sprite, sprite.cover)

    area, middle = at(150.0, 200.0)
    for shift in ((0.13, 0.0), (0.5, -0.71)):
        moved, place = at(150.0 + shift[0], 200.0 + shift[1])
        assert moved == pytest.approx(area, rel=2e-3)
        np.testing.assert_allclose(place - middle, shift, atol=0.02)


def test_zoomed_and_rolled_cameras_see_the_same_tree() -> None:
    value = tree(foot_px=(160.0, 150.0), height_px=60.0, crown_px=(40.0, 42.0))
    geometry = CONTEXT.geometry
    first = drawn(value)
    zoomed = drawn(value, CameraPose(CONTEXT, geometry.zoomed(2.0), np.eye(3), np.zeros(3)))
    assert zoomed.cover.sum() == pytest.approx(4 * first.cover.sum(), rel=3e-3)
    rolled = drawn(value, CameraPose(CONTEXT, geometry, geometry.rotation(np.array([0.0, 0.0, 0.3])), np.zeros(3)))
    # A camera that rolls clockwise sees the scene rotate the other way.
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    expected = geometry.principal + (centroid(first, first.cover) - geometry.principal) @ turn
    np.testing.assert_allclose(centroid(rolled, rolled.cover), expected, atol=0.05)


class TestCrowns:
    def test_a_long_trunk_has_crowns_all_the_way(self) -> None:
        small, lone = placed_over(SMALL), placed_over(SMALL, tiers=1)
        high, (wide, tall) = required(small.height_px), required(small.crown_px)
        assert high > 5 * tall
        sprite, other = drawn(small), drawn(lone)
        leafy = [(each.cover > 0.5).sum(axis=1) > 0.5 * wide for each in (sprite, other)]
        assert leafy[0].sum() > 0.7 * high
        assert leafy[1].sum() < 1.1 * tall
        large = Box(160.0, 120.0, 60.0, 40.0)
        assert (placed_over(large).tiers, placed_over(large, tiers=2).tiers) == (1, 2)
        higher = small.standing_at(130.0)
        assert 1 <= required(higher.tiers) < required(small.tiers)
        assert higher.extent(CONTEXT).bottom <= 130.0 + 0.5

    @pytest.mark.parametrize(
        ("keys", "place", "why"),
        [
            # The fourth is 1.25^3 times as high as the first, its top 0.38 (1 + 1.25 + 1.25^2) heights lower.
            ("height_px: 80, crown_px: [30, 30], tiers: 4", "tiers", "end 22.06 px below its foot; allowed: 3"),
            ("height_px: 60, crown_px: [60, 90]", "crown_px", "30 px below its foot; allowed: 60 px high"),
        ],
    )
    def test_crowns_below_the_foot_are_refused(self, keys: str, place: str, why: str) -> None:
        with pytest.raises(InputError, match=rf"occluders\.oak\.{place}: .*{why}"):
            loads(
                "background: {kind: ground}\n"
                "targets: [{id: car, shape: {kind: car}, path: {kind: straight, start: [40, 60], range_m: 300}}]\n"
                f"occluders: [{{kind: tree, id: oak, range_m: 90, foot_px: [100, 100], {keys}}}]\n"
            )

    @pytest.mark.parametrize("tiers", [1, 3])
    def test_nothing_is_drawn_below_the_foot(self, tiers: int) -> None:
        """At the least height allowed for the number of crowns."""
        deep = 20.0 * (1.25 ** (tiers - 1) + 0.38 * sum(1.25**each for each in range(tiers - 1)))
        value = tree(foot_px=(160.0, 200.0), height_px=deep, crown_px=(20.0, 20.0), tiers=tiers, leaves=1.0)
        assert value.extent(CONTEXT).bottom <= 200 + 1e-6
        sprite = drawn(value)
        assert sprite.cover[int(np.ceil(200.5)) - sprite.y0 :].max(initial=0.0) < 1e-6

    def test_fewer_crowns_than_requested_are_warned_of(self) -> None:
        intent = tree(**INTENT, tiers=6)
        full = intent.covering(SMALL, 1.0, CONTEXT)
        assert intent.shortfall(full) is None
        short = intent.shortfall(full.standing_at(130.0))
        assert short is not None
        assert short[0] == "tiers"
        assert "so 6 of them need a tree" in short[1]
        text = """\
camera: {size: [320, 240], ifov_mrad: 0.5, elevation_deg: -3}
background: {kind: landscape, camera_height_m: 10}
targets:
  - {id: car, shape: {kind: car}, path: {kind: straight, start: [40, 80], speed: 1.5, ground_m: 10}}
occluders: [{kind: tree, id: oak, hides: car, frames: [50, 56], range_m: 150, tiers: 6}]
"""
        assert ("occluders", 0, "tiers") in {notice.at for notice in lint(loads(text))}

    def test_no_wood_is_visible_between_crowns(self) -> None:
        keys = {"trunk_k": 300.0, "temperature_k": 285.0, "spread_k": 0.0, "emissivity": 1.0}
        flat = drawn(tree(crown_px=(45.0, 50.0), tiers=4, **keys))
        inside = slice(60 - flat.y0, 160 - flat.y0), slice(154 - flat.x0, 167 - flat.x0)
        assert np.ptp(temperature("lwir", flat.emission[inside])) < 0.01


@pytest.mark.parametrize(
    ("background", "hour", "leaves_k"),
    [("ground", "any", 290.0), ("ground", "day", 297.0), ("landscape", "night", 285.5)],
)
def test_default_temperatures_are_those_of_the_hour(background: str, hour: str, leaves_k: float) -> None:
    """Those of a landscape's own trees; given temperatures stay."""

    def warmth(keys: str = "") -> tuple[float, float]:
        scenario = loads(
            f"background: {{kind: {background}, hour: {hour}}}\n"
            "targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 90]}}]\n"
            "occluders: [{kind: tree, id: oak, range_m: 90, foot_px: [60, 100], height_px: 80, crown_px: [50, 50], "
            f"spread_k: 0, emissivity: 1{keys}}}]\n"
        )
        (oak,) = scenario.occluders
        assert isinstance(oak, Tree)
        sprite = drawn(oak, CameraPose.first(scenario.context))
        middle = np.unravel_index(int(np.argmax(sprite.alpha)), sprite.alpha.shape)
        seen = float(temperature(scenario.context.band, sprite.emission[middle] / sprite.alpha[middle]))
        assert seen == pytest.approx(oak.warmth(scenario.context)[0], abs=0.3)
        return oak.warmth(scenario.context)

    assert warmth() == (leaves_k, leaves_k + 1)
    assert warmth(", temperature_k: 280") == (280, leaves_k + 1)
    assert warmth(", trunk_k: 310") == (leaves_k, 310)

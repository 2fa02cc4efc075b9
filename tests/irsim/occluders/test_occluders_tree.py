"""Trees that hide: what they cover, wherever and however large they are seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.silhouette import Grid
from irsim.geometry.sprite import Sprite
from irsim.lint import doubts
from irsim.occluders import OCCLUDERS
from irsim.occluders.base import given
from irsim.occluders.billboard import Billboard
from irsim.occluders.tree import Tree
from irsim.physics.radiometry import temperature
from irsim.scenario.loader import loads
from irsim.types import Box, Floats

STAGE = SceneContext(0, Geometry((320, 240), 5e-4), 30.0, "lwir", 0.6)
SEEDS = range(6)


def tree(**keys: Any) -> Tree:
    given = {"foot_px": (160.0, 220.0), "height_px": 180.0, "crown_px": (120.0, 130.0), "range_m": 90.0, "id": "oak"}
    value = OCCLUDERS.parse({"kind": "tree", **given, **keys})
    assert isinstance(value, Tree)
    return value


def drawn(value: Tree, pose: CameraPose | None = None, context: SceneContext = STAGE) -> Sprite:
    sprite = value.draw(pose or CameraPose.first(context))
    assert sprite is not None
    return sprite


def centroid(sprite: Sprite) -> Floats:
    """(x, y) px of what it covers."""
    rows, columns = np.indices(sprite.cover.shape)
    x, y = np.vdot(sprite.cover, columns + sprite.x0), np.vdot(sprite.cover, rows + sprite.y0)
    return np.asarray([x, y]) / float(sprite.cover.sum())


WINDOWS = [Box(150.3, 60.2, 30.0, 12.0), Box(90.7, 70.0, 9.0, 33.0), Box(200.0, 80.5, 5.0, 4.0)]


@pytest.mark.sampled
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("window", WINDOWS)
def test_it_hides_all_of_what_it_is_placed_over(seed: int, window: Box) -> None:
    context = SceneContext(seed, STAGE.geometry, 30.0, "lwir", 0.6)
    # The margin that intents have: the optics blur gaps beyond it by 0.6 px.
    wider = Box(window.cx, window.cy, window.w + 2, window.h + 2)
    placed = tree(foot_px=None, height_px=None, crown_px=None, hides="car", frames=(0, 9)).over(wider, 1.0, context)
    sprite = drawn(placed, context=context)
    # Pixels that lie in the window with all of their area.
    columns = slice(round(np.ceil(window.left + 0.5)) - sprite.x0, round(np.floor(window.right - 0.5)) + 1 - sprite.x0)
    rows = slice(round(np.ceil(window.top + 0.5)) - sprite.y0, round(np.floor(window.bottom - 0.5)) + 1 - sprite.y0)
    assert sprite.cover[rows, columns].size > 10
    assert sprite.cover[rows, columns].min() == pytest.approx(1, abs=1e-3)


@pytest.mark.sampled
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("leaves", [0.0, 0.8])
def test_it_is_no_larger_than_it_has_to_be(seed: int, window: Box, leaves: float) -> None:
    """A bare crown hides all in its core alone, whose ellipse then goes through the window's corners, 0.6 sin 60 of
    the crown wide; a leafy one in more of it."""
    context = SceneContext(seed, STAGE.geometry, 30.0, "lwir", 0.6)
    unplaced = tree(foot_px=None, height_px=None, crown_px=None, hides="car", frames=(0, 9), leaves=leaves)
    placed = unplaced.over(window, 1.0, context)
    assert placed.crown_px is not None
    share = placed.crown_px[0] * 0.6 * np.sin(np.radians(60)) / window.w
    assert share < (1.0 if leaves == 0 else 0.9)


@pytest.mark.parametrize("seed", SEEDS)
def test_its_rim_is_ragged_and_has_gaps_and_its_middle_none(seed: int) -> None:
    sprite = drawn(tree(), context=SceneContext(seed, STAGE.geometry, 30.0, "lwir", 0.6))
    rows, columns = np.indices(sprite.cover.shape)
    x, y = columns + sprite.x0, rows + sprite.y0
    off = np.hypot((x - 160) / 60, (y - (220 - 180 + 65)) / 65)
    assert sprite.cover[off < 0.57].min() == pytest.approx(1, abs=1e-6)
    rim = sprite.cover[(off > 0.8) & (off < 0.95)]
    assert 0.2 < rim.mean() < 0.95
    assert (rim < 0.05).mean() > 0.02
    assert sprite.cover[(off > 1.35) & (y < 150)].max(initial=0.0) == 0


def test_the_fewer_leaves_the_more_gaps() -> None:
    covers = [drawn(tree(leaves=leaves)).cover.sum() for leaves in (1.0, 0.8, 0.4, 0.0)]
    assert covers == sorted(covers, reverse=True)
    assert covers[-1] < 0.8 * covers[0]


def test_its_trunk_is_warm_and_stands_on_its_foot() -> None:
    sprite = drawn(tree(trunk_k=300.0, temperature_k=285.0, spread_k=0.0, emissivity=1.0))
    # The crown ends 50 px above the foot, where the trunk is 120 * 0.065 px wide and then 1.35 times that.
    low = sprite.cover[217 - sprite.y0]
    assert low.sum() == pytest.approx(120 * 0.065 * 1.35, rel=0.05)
    x = np.arange(len(low)) + sprite.x0
    assert (low * x).sum() / low.sum() == pytest.approx(160, abs=1e-6)
    assert sprite.box.bottom == pytest.approx(220)
    middle = (200 - sprite.y0, 160 - sprite.x0)
    assert temperature("lwir", sprite.emission[middle]) == pytest.approx(300, abs=0.01)
    assert temperature("lwir", sprite.emission[105 - sprite.y0, 160 - sprite.x0]) == pytest.approx(285, abs=0.01)


@pytest.mark.parametrize("spread_k", [0.5, 2.0])
def test_its_leaves_spread_about_their_temperature(spread_k: float) -> None:
    sprite = drawn(tree(temperature_k=290.0, spread_k=spread_k, trunk_k=290.0, emissivity=1.0))
    whole = sprite.alpha > 0.999
    kelvin = temperature("lwir", sprite.emission[whole])
    # The middle alone is looked at, through the optics: less varied than all leaves of it.
    assert kelvin.mean() == pytest.approx(290, abs=0.3 * spread_k)
    assert 0.5 * spread_k < kelvin.std() < 1.05 * spread_k


@pytest.mark.parametrize("crown", [(9.0, 10.0), (40.0, 44.0), (120.0, 130.0)])
def test_a_shift_moves_it_by_just_that(crown: tuple[float, float]) -> None:
    def at(x: float, y: float) -> tuple[float, Floats]:
        sprite = drawn(tree(crown_px=crown, height_px=crown[1] * 1.4, foot_px=(x, y)))
        return sprite.cover.sum(), centroid(sprite)

    area, middle = at(150.0, 200.0)
    for shift in ((0.13, 0.0), (0.5, 0.37), (0.0, -0.71)):
        moved, place = at(150.0 + shift[0], 200.0 + shift[1])
        assert moved == pytest.approx(area, rel=2e-3)
        np.testing.assert_allclose(place - middle, shift, atol=0.02)


@pytest.mark.parametrize("crown", [(0.01, 300.0), (5000.0, 0.2), (1e-6, 1e-6), (1e5, 1e5)])
def test_crowns_of_any_size_and_proportion_are_drawn(crown: tuple[float, float]) -> None:
    sprite = drawn(tree(crown_px=crown, height_px=max(180.0, crown[1]), leaves=0.0))
    assert np.isfinite(sprite.emission).all()
    assert sprite.cover.min() >= -1e-6
    assert sprite.cover.max() <= 1 + 1e-6


def test_a_longer_lens_and_a_turned_camera_see_the_same_tree() -> None:
    value = tree(foot_px=(160.0, 150.0), height_px=60.0, crown_px=(40.0, 42.0))
    geometry = STAGE.geometry
    near = CameraPose(STAGE, geometry.zoomed(2.0), np.eye(3), np.zeros(3))
    turned = CameraPose(STAGE, geometry, geometry.rotation(np.array([0.0, 0.0, 0.3])), np.zeros(3))
    first = drawn(value)
    assert drawn(value, near).cover.sum() == pytest.approx(4 * first.cover.sum(), rel=3e-3)
    rolled = drawn(value, turned)
    assert rolled.cover.sum() == pytest.approx(first.cover.sum(), rel=3e-3)
    # A camera that rolls clockwise sees all turn the other way about its axis.
    expected = geometry.principal + (centroid(first) - geometry.principal) @ np.array(
        [[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]]
    )
    np.testing.assert_allclose(centroid(rolled), expected, atol=0.05)


def test_a_picture_of_one_colour_covers_its_rectangle() -> None:
    """From (2.25, 3.5) to (9.25, 7.5) in px from the grid's corner: exact but for a little blur of its edges."""
    light = np.pad(np.full((40, 70, 2), [1.0, 7.0], np.float32), ((10, 10), (10, 10), (0, 0)))
    grid = Grid(0, 0, 12, 12, 2)
    corners = np.array([[1.25, 2.5], [10.25, 2.5], [10.25, 8.5], [1.25, 8.5]]) + grid.corner
    area, down, right = Billboard(light).fields(corners, grid)
    np.testing.assert_allclose(area[1], 7 * area[0], rtol=1e-6)
    assert area[0].sum() / 4 == pytest.approx(7 * 4, rel=1e-3)
    np.testing.assert_allclose(area[0, 8:14, 6:17], 1.0, atol=1e-6)
    # Where whole cells are covered there is no moment; at the left edge, more lies to the right.
    np.testing.assert_allclose(right[0, 8:14, 6:17], 0.0, atol=1e-6)
    assert right[0, 10, 4] > 0.05
    assert down[0, 7, 10] == pytest.approx(0.0, abs=0.04)
    x, y = np.arange(24) / 2 + 0.25, np.arange(24) / 2 + 0.25
    moments = (area[0] * x + right[0] / 2).sum(), (area[0] * y[:, None] + down[0] / 2).sum()
    np.testing.assert_allclose(np.array(moments) / area[0].sum(), [5.75, 5.5], atol=2e-3)


def placed_over(window: Box, **keys: Any) -> Tree:
    intent = tree(foot_px=None, height_px=None, crown_px=None, hides="car", frames=(0, 9), **keys)
    return intent.over(window, 1.0, STAGE)


def test_a_long_trunk_has_crowns_all_the_way() -> None:
    """Five times as high as its top crown, a tree with one would be a ball on a stick."""
    small = placed_over(Box(200.0, 60.0, 16.0, 12.0))
    assert small.height_px is not None
    assert small.crown_px is not None
    assert small.height_px > 5 * small.crown_px[1]
    sprite, lone = drawn(small), drawn(placed_over(Box(200.0, 60.0, 16.0, 12.0), tiers=1))
    leaves = [(each.cover > 0.5).sum(axis=1) > 0.5 * small.crown_px[0] for each in (sprite, lone)]
    assert leaves[0].sum() > 0.7 * small.height_px
    assert leaves[1].sum() < 1.1 * small.crown_px[1]
    widths = (sprite.cover[: round(0.7 * small.height_px)] > 0.5).sum(axis=1)
    assert widths[-20:].mean() > 1.5 * widths[5:25].mean()  # wider towards the ground


def test_a_crown_that_is_large_on_its_tree_stays_alone() -> None:
    large = placed_over(Box(160.0, 120.0, 60.0, 40.0))
    assert large.tiers == 1
    assert placed_over(Box(160.0, 120.0, 60.0, 40.0), tiers=2).tiers == 2
    assert tree().crowns(STAGE)[0][0] is tree(tiers=3, height_px=400.0).crowns(STAGE)[0][0]


def test_what_stands_higher_has_fewer_crowns_and_no_leaves_below_its_foot() -> None:
    small = placed_over(Box(200.0, 60.0, 16.0, 12.0))
    higher = small.rooted(130.0)
    assert small.tiers is not None
    assert higher.tiers is not None
    assert 1 <= higher.tiers < small.tiers
    assert higher.extent(STAGE).bottom <= 130.0 + 0.5


@pytest.mark.parametrize(
    ("keys", "place", "why"),
    [
        # The fourth of them is 1.25^3 times as high as the first, its top 0.38 (1 + 1.25 + 1.25^2) heights lower.
        ({"height_px": 80.0, "crown_px": (30.0, 30.0), "tiers": 4}, "tiers", "end 22.06 px below its foot; allowed: 3"),
        ({"height_px": 60.0, "crown_px": (60.0, 90.0)}, "crown_px", "30 px below its foot; allowed: 60 px high"),
        ({"height_px": 60.0, "crown_px": (60.0, 90.0), "tiers": 2}, "crown_px", "30 px below its foot"),
    ],
)
def test_crowns_that_would_end_below_its_foot_are_refused(keys: dict[str, Any], place: str, why: str) -> None:
    lines = ", ".join(f"{key}: {list(value) if isinstance(value, tuple) else value}" for key, value in keys.items())
    text = f"""\
background: {{kind: ground}}
targets:
  - {{id: car, shape: {{kind: car}}, path: {{kind: straight, start: [40, 60], speed: 1, range_m: 300}}}}
occluders: [{{kind: tree, id: oak, range_m: 90, foot_px: [100, 100], {lines}}}]
"""
    with pytest.raises(InputError, match=rf"occluders\.oak\.{place}: .*{why}"):
        loads(text)


@pytest.mark.parametrize("tiers", [1, 2, 3, 5])
def test_nothing_of_a_tree_is_drawn_below_its_foot(tiers: int) -> None:
    """Down to the least height that is allowed of so many crowns."""
    deep = 20.0 * (1.25 ** (tiers - 1) + 0.38 * sum(1.25**each for each in range(tiers - 1)))
    value = tree(foot_px=(160.0, 200.0), height_px=deep, crown_px=(20.0, 20.0), tiers=tiers, leaves=1.0)
    assert value.extent(STAGE).bottom <= 200 + 1e-6
    sprite = drawn(value)
    below = sprite.cover[int(np.ceil(200.5)) - sprite.y0 :]
    assert below.max(initial=0.0) < 1e-6


def test_crowns_that_were_asked_for_and_have_no_room_where_it_stands_are_told() -> None:
    asked = tree(foot_px=None, height_px=None, crown_px=None, hides="car", frames=(0, 9), tiers=6)
    below = asked.over(Box(200.0, 60.0, 16.0, 12.0), 1.0, STAGE)
    assert asked.short(below) is None
    assert below.extent(STAGE).bottom <= given(below.foot_px)[1] + 1e-6
    higher = below.rooted(130.0)
    assert higher.extent(STAGE).bottom <= 130 + 1e-6
    lack = asked.short(higher)
    assert lack is not None
    assert lack[0] == "tiers"
    assert lack[1].startswith(f"it has {higher.tiers} crown")
    assert "so 6 of them need a tree" in lack[1]
    text = """\
camera: {size: [320, 240], ifov_mrad: 0.5, elevation_deg: -3}
background: {kind: landscape, camera_height_m: 10}
targets:
  - {id: car, shape: {kind: car}, path: {kind: straight, start: [40, 80], speed: 1.5, ground_m: 10}}
occluders: [{kind: tree, id: oak, hides: car, frames: [50, 56], range_m: 150, tiers: 6}]
"""
    told = {notice.at: notice.message for notice in doubts(loads(text))}
    assert "the top one, which hides car, is" in told["occluders", 0, "tiers"]


def test_no_wood_shows_where_its_crowns_meet() -> None:
    flat = drawn(tree(crown_px=(45.0, 50.0), tiers=4, trunk_k=300.0, temperature_k=285.0, spread_k=0.0, emissivity=1.0))
    inside = slice(60 - flat.y0, 160 - flat.y0), slice(154 - flat.x0, 167 - flat.x0)
    assert np.ptp(temperature("lwir", flat.emission[inside])) < 0.01


def test_no_dark_edge_of_a_crown_lies_on_the_lit_top_of_the_next() -> None:
    """From the side of several crowns the light falls, as on a lone one; from above on that one alone."""

    forms = [tree().crowns(SceneContext(seed, STAGE.geometry, 30.0, "lwir", 0.6))[0][0] for seed in range(10)]

    def warmer(name: str, axis: int) -> float:
        """How much warmer, in standard deviations of them, leaves are above the middle (axis 0) or left of it (1)."""
        differences = []
        for form in forms:
            first = np.indices(form.leaves.shape)[axis] < form.leaves.shape[axis] / 2
            warmth = getattr(form, name)
            differences.append(warmth[form.leaves & first].mean() - warmth[form.leaves & ~first].mean())
        return float(np.mean(differences))

    assert warmer("warmth", 0) > 0.4
    assert abs(warmer("joined", 0)) < 0.15
    assert warmer("warmth", 1) > 0.3
    assert warmer("joined", 1) > 0.3


def test_its_trunk_is_lit_from_the_side_and_streaked() -> None:
    sprite = drawn(tree(trunk_k=300.0, temperature_k=285.0, spread_k=1.0, emissivity=1.0, crown_px=(200.0, 130.0)))
    columns = slice(160 - 4 - sprite.x0, 160 + 5 - sprite.x0)
    kelvin = temperature("lwir", sprite.emission[180 - sprite.y0 : 216 - sprite.y0, columns])
    across, down = kelvin.mean(axis=0), kelvin.mean(axis=1)
    assert across[0] - across[-1] > 0.5
    assert kelvin.mean() == pytest.approx(300, abs=0.5)
    assert down.std() > 0.02

"""Visible fraction of a target behind bars, clouds and other targets, and at the edge of the frame."""

from __future__ import annotations

import numpy as np
import pytest
from quiet_scenes import standing as scene

from irsim.render.frame import Renderer
from irsim.render.stream import Rendering


def test_a_body_larger_than_the_frame_is_partly_visible() -> None:
    """Coming straight at the middle of the frame, all of which it fills in the end: its size goes with 1/range."""
    shape, shares, widths = {"kind": "fighter", "length_m": 15.0}, [], []
    for range_m in (360.0, 30.0, 12.0):
        path = {"kind": "straight", "start": (80.0, 60.0), "speed": 0.0, "range_m": range_m}
        target = {"id": "one", "shape": shape, "path": path, "attitude_deg": (0.0, 0.0, 90.0)}
        (truth,) = next(iter(Rendering(scene(targets=[target])).truths())).targets
        assert truth.visible is not None
        shares.append(truth.visible)
        widths.append(truth.box.w)
    assert shares[0] == pytest.approx(1, abs=1e-6)
    assert widths[1] > 5 * 160
    assert 0 < shares[2] < shares[1] < 0.5
    # Of a frame that it fills, the share is the frame's area over its own: 19,200 px2 over what grew by the range.
    whole = Rendering(scene(targets=[target]))._renderer
    (piece,) = whole.pieces(0)
    assert shares[2] * piece.sprite.area == pytest.approx(160 * 120, rel=1e-6)


def bar(**keys: object) -> list[dict[str, object]]:
    return [{"kind": "bar", "center_px": (80.0, 60.0), "size_px": (40.0, 40.0), "range_m": 500.0, **keys}]


@pytest.mark.parametrize(("range_m", "visible", "names"), [(500.0, 0, ("bar",)), (2000.0, 1, ())])
def test_a_bar_hides_only_targets_behind_it(range_m: float, visible: float, names: tuple[str, ...]) -> None:
    (target,) = next(iter(Rendering(scene(occluders=bar(range_m=range_m))).truths())).targets
    assert target.visible == pytest.approx(visible, abs=1e-9)
    assert target.occluders == names


@pytest.mark.parametrize("edge", [-2.0, 1.3])
def test_visible_fraction_is_the_uncovered_share_of_area(edge: float) -> None:
    """The share of a target right of a straight edge, against its own coverage counted per column."""
    renderer = Renderer(scene())
    (piece,) = renderer.pieces(0)
    sprite = piece.sprite
    left = sprite.center[0] + edge  # the bar covers everything left of this
    columns = sprite.x0 + np.arange(sprite.cover.shape[1])
    kept = np.clip(columns + 0.5 - left, 0, 1)
    expected = (sprite.cover * kept).sum() / sprite.cover.sum()
    hidden = scene(occluders=bar(center_px=(left - 30, 60.0), size_px=(60.0, 80.0)))
    (target,) = next(iter(Rendering(hidden).truths())).targets
    assert target.visible == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(("share", "told"), [(0.005, ()), (0.02, ("bar",))])
def test_an_occluder_of_a_hundredth_is_named(share: float, told: tuple[str, ...]) -> None:
    """A bar whose straight edge has that share of the target left of it, by its coverage counted per column."""
    (piece,) = Renderer(scene()).pieces(0)
    sprite = piece.sprite
    columns = np.cumsum(sprite.cover.sum(axis=0)) / sprite.cover.sum()
    left = float(np.interp(share, columns, sprite.x0 + np.arange(columns.size) + 0.5))
    hidden = scene(occluders=bar(center_px=(left - 30, 60.0), size_px=(60.0, 80.0)))
    (target,) = next(iter(Rendering(hidden).truths())).targets
    assert target.visible == pytest.approx(1 - share, abs=0.2 * share)
    assert target.occluders == told


def test_a_target_at_the_edge_is_partly_visible() -> None:
    (target,) = next(iter(Rendering(scene(x=4.0)).truths())).targets
    assert target.visible is not None
    assert 0.2 < target.visible < 0.8
    assert target.in_view


@pytest.mark.parametrize("psf_px", [0.0, 0.6])
def test_parts_outside_the_frame_are_not_visible(psf_px: float) -> None:
    """Without blur the patch of a body ends at the picture's edge."""
    cut = scene(shape="truck", x=158.0, camera={"size": (160, 120), "netd_mk": 0.0, "psf_px": psf_px})
    wide = scene(shape="truck", x=158.0, camera={"size": (320, 120), "netd_mk": 0.0, "psf_px": 0.6})
    target, whole = (next(iter(Rendering(each).truths())).targets[0] for each in (cut, wide))
    (piece,) = Renderer(cut).pieces(0)
    inside = piece.sprite.cover[:, : 160 - piece.sprite.x0]
    assert whole.visible == 1
    assert target.visible == pytest.approx(inside.sum() / piece.sprite.area, abs=1e-9)
    assert target.visible is not None
    assert 0.3 < target.visible < 0.9


def test_each_occluder_that_hides_by_itself_is_named() -> None:
    """The nearer bar hides nothing that the farther one leaves, and hides the target all the same."""
    bars = [*bar(id="far", range_m=700.0), *bar(id="near", range_m=500.0)]
    (target,) = next(iter(Rendering(scene(occluders=bars)).truths())).targets
    assert target.occluders == ("far", "near")


def test_a_target_outside_changes_no_pixel() -> None:
    outside = Rendering(scene(x=-100.0))
    (target,) = next(iter(outside.truths())).targets
    assert target.visible == 0
    assert target.in_view is False
    empty = Rendering(scene(targets=[]))
    assert np.array_equal(outside.frame(0).image, empty.frame(0).image)


def test_a_thick_cloud_hides_only_targets_behind_it() -> None:
    cloud = {"coverage": 0.999, "depth": 1000.0}
    for cloud_range, visible in ((500.0, 0.0), (5000.0, 1.0)):
        sky = {"kind": "sky", "clouds": [{**cloud, "range_m": cloud_range}]}
        (target,) = next(iter(Rendering(scene(background=sky)).truths())).targets
        assert target.visible == pytest.approx(visible, abs=1e-6)
        assert target.occluders == (("clouds",) if visible == 0 else ())


def test_a_nearer_target_hides_a_farther_one() -> None:
    targets = [
        {
            "id": name,
            "shape": {"kind": "fighter"},
            "path": {"kind": "straight", "start": (80.0, 60.0), "speed": 0.0, "range_m": range_m},
        }
        for name, range_m in (("near", 1000.0), ("far", 2000.0))
    ]
    truth = next(iter(Rendering(scene(targets=targets)).truths()))
    near, far = truth.target("near"), truth.target("far")
    assert near is not None
    assert far is not None
    assert near.visible == 1
    assert far.visible is not None
    assert far.visible < 0.2
    assert far.occluders == ("near",)
    assert near.crossing
    assert far.crossing

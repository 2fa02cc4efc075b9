"""Examples: the demo scenes separate the shipped trackers; occlusion and glare are those of their texts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import irsim
from irsim.calibration.stretch import jumps
from irsim.occluders.solid import Building
from irsim.occluders.tree import Tree
from irsim.render.frame import Renderer
from irsim.scenario.catalog import examples
from irtrack.bench import run_bench

SEEDS = 30


@pytest.mark.parametrize("name", ["sky", "ground"])
def test_the_demo_scene_separates_trackers(name: str, tmp_path: Path) -> None:
    """Over 30 seeds one tracker holds the target in at least 80 %, and another loses it in at least 20 %."""
    results = run_bench([name], ["grey_pf", "template", "kalman"], results=tmp_path / "demo.db", seeds=SEEDS, jobs=2)
    lost: dict[str, int] = {}
    for cell in results.cells():
        assert cell.score is not None
        lost[cell.label] = lost.get(cell.label, 0) + bool(cell.score.lost)
    assert min(lost.values()) <= 0.2 * SEEDS
    assert max(lost.values()) >= 0.2 * SEEDS


def test_occlusion_matches_the_scenario() -> None:
    scene = irsim.load("hiding")
    level = scene.background.surface_m
    assert level is not None
    context = scene.context
    for target in scene.targets:  # a car's place is on the level of its wheels
        below = target.path.positions(np.arange(200.0), context, target.id) @ context.geometry.down
        np.testing.assert_allclose(below, level, atol=0.01)
    for occluder in Renderer(scene).occluders[:2]:
        assert isinstance(occluder, Tree | Building)
        assert occluder.foot_px is not None
        assert 130 < occluder.foot_px[1] < 239
        below = context.geometry.place(np.array(occluder.foot_px), occluder.range_m) @ context.geometry.down
        assert below == pytest.approx(level, abs=0.1)
    truths = list(irsim.Rendering(scene).truths())
    shares = np.array([car.visible for each in truths if (car := each.target("car")) is not None], dtype=float)
    assert len(shares) == 200
    for frames, least, most in [((35, 42), 0.4, 0.52), ((66, 78), 0.0, 0.02), ((150, 165), 0.05, 0.12)]:
        part = shares[frames[0] : frames[1] + 1]
        assert least <= part.min()
        assert part.max() <= most
    assert shares[:15].min() > 0.99
    assert shares[122:132].min() > 0.99  # between the crossing and the smoke


def test_the_glare_saturates_and_blooms() -> None:
    rendering, bare = irsim.open_source("glare"), irsim.open_source("glare", without=["bloom"])
    full = 2**14 - 1
    first, second = (np.count_nonzero(source.frame(60).image == full) for source in (bare, rendering))
    assert 1 <= first < second
    sharp = irsim.open_source("glare", without=["smear"])
    target = [truth.target("rocket") for truth in sharp.truths()]
    assert all(each is not None and each.in_view for each in target)


@pytest.mark.parametrize("name", list(examples())[::4])
def test_an_example_shows_its_target_without_a_cut(name: str) -> None:
    """No frame is a jump from the one before (`irsim.calibration.stretch.jumps`)."""
    rendering = irsim.open_source(name)
    pairs = list(rendering.pairs(stop=10))
    target = next(iter(rendering.truths())).target(rendering.follow or "")
    assert target is not None
    assert target.visible is not None
    assert target.visible >= 0.5
    assert jumps([frame.image for frame, _ in pairs]) == []


@pytest.mark.parametrize("name", ["crossover", "treeline"])
def test_contrast_changes_sign_in_an_example(name: str) -> None:
    rendering = irsim.open_source(name)
    targets = [truth.target(rendering.follow or "") for truth in rendering.truths()]
    contrasts = [target.contrast_k for target in targets if target is not None and target.contrast_k is not None]
    assert contrasts[0] > 4
    assert min(contrasts) < -0.5

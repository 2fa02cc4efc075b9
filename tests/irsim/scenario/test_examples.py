"""The shipped scenarios: they load, they render, and the demo's two are not toys."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import irsim
from irsim.calibration.stretch import jumps
from irsim.occluders.standing import Building
from irsim.occluders.tree import Tree
from irsim.render.frame import Renderer
from irsim.scenario.loader import examples
from irtrack.bench import run_bench

SEEDS = 30


@lru_cache
def loaded(name: str) -> irsim.Scenario:
    """Of some the loading takes seconds: what hides a target is placed meanwhile."""
    return irsim.load(name)


@pytest.mark.sampled
@pytest.mark.parametrize("path", examples().values(), ids=examples().keys())
def test_every_example_says_what_it_is_for_shows_its_target_and_is_not_cut(path: Path) -> None:
    """No picture of it is told to be another than the one before, as of a shutter (`irsim.calibration.stretch.jumps`)."""
    rendering = irsim.Rendering(loaded(path.stem))
    assert rendering.scenario.about
    assert path.read_text().startswith("#")
    pairs = list(rendering.pairs(stop=30))
    _, truth = pairs[0]
    assert truth is not None
    target = truth.target(rendering.follow or "")
    assert target is not None
    assert target.visible is not None
    assert target.visible >= 0.5
    assert jumps([frame.image for frame, _ in pairs]) == []


def test_every_example_stands_in_the_documents_with_its_picture() -> None:
    docs = Path(__file__).parents[3] / "docs"
    page = (docs / "examples.md").read_text()
    front = (docs.parent / "README.md").read_text()
    for name in examples():
        assert f"## {name}\n\n{loaded(name).about}\n" in page
        assert f"![{name}](docs/img/{name}.png)" in front
        assert (docs / "img" / f"{name}.png").is_file()


@pytest.mark.parametrize("name", ["crossover", "treeline"])
def test_contrast_goes_and_turns_where_an_example_says_so(name: str) -> None:
    rendering = irsim.Rendering(loaded(name))
    targets = [truth.target(rendering.follow or "") for truth in rendering.truths()]
    contrasts = [target.contrast_k for target in targets if target is not None and target.contrast_k is not None]
    assert contrasts[0] > 4
    assert min(contrasts) < -0.5


def test_what_is_hidden_is_hidden_as_it_is_written_and_stands_on_the_ground() -> None:
    scene = loaded("hiding")
    level = scene.background.surface_m
    assert level is not None
    context = scene.context
    for target in scene.targets:  # a car's place is on the level of its wheels
        below = target.path.positions(np.arange(200.0), context, target.id) @ context.geometry.down
        np.testing.assert_allclose(below, level, atol=0.01)
    for occluder in Renderer(scene).occluders[:2]:  # they stand in the picture, where the ground is as far away as they
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


def test_the_tree_of_a_new_ground_stands_on_it_and_stands_out() -> None:
    """Its foot in the picture, where the ground is as far away; leaves and trunk colder than all but the coldest
    tenth of the ground around, as in the sun: as warm as the ground, it looked like glass."""
    scene = irsim.load("new/ground", ["camera.netd_mk=0"])
    (tree,) = Renderer(scene).occluders
    assert isinstance(tree, Tree)
    assert tree.foot_px is not None
    assert tree.height_px is not None
    assert tree.crown_px is not None
    (x, y), tall = tree.foot_px, tree.crown_px[1]
    assert 150 < y < 250
    below = scene.context.geometry.place(np.array(tree.foot_px), tree.range_m) @ scene.context.geometry.down
    assert below == pytest.approx(scene.background.surface_m, abs=0.1)
    counts = irsim.Rendering(scene).frame(0).image.astype(float)
    middle = round(y - tree.height_px + tall / 2)
    leaves = counts[middle - 15 : middle + 16, round(x) - 15 : round(x) + 16]
    trunk = counts[round(y) - 20 : round(y) - 5, round(x)]
    ground = np.delete(counts, np.s_[round(x) - 70 : round(x) + 70], axis=1)
    assert np.quantile(leaves, 0.9) < np.quantile(ground, 0.1)
    assert trunk.mean() < np.quantile(ground, 0.1)


@pytest.mark.sampled
@pytest.mark.parametrize("part", ["optics", "falloff", "smear", "bloom"])
def test_every_part_of_the_lens_shows_in_the_glare(part: str) -> None:
    """Somewhere by ten times what a pixel's noise is at 300 K, where it is larger than before this sky."""
    whole, without = (irsim.open_source("glare", without=names).frame(60).image for names in ((), (part,)))
    response = loaded("glare").camera.response()
    assert np.abs(whole.astype(float) - without).max() > 10 * response.noise / response.gain


def test_the_glare_saturates_blooms_and_is_followed_by_a_fast_slew() -> None:
    rendering, bare = irsim.open_source("glare"), irsim.open_source("glare", without=["bloom"])
    full = 2**14 - 1
    first, second = (np.count_nonzero(source.frame(60).image == full) for source in (bare, rendering))
    assert 1 <= first < second
    sharp = irsim.open_source("glare", without=["smear"])  # by which nothing leaves the view
    target = [truth.target("rocket") for truth in sharp.truths()]
    assert all(each is not None and each.in_view for each in target)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sky", "ground"])
def test_one_tracker_holds_the_demo_scene_and_another_loses_it(name: str, tmp_path: Path) -> None:
    """Over 30 seeds: held in at least 80 % by one shipped tracker, lost in at least 20 % by another."""
    results = run_bench([name], ["grey_pf", "template", "kalman"], results=tmp_path / "demo.db", seeds=SEEDS, jobs=2)
    lost: dict[str, int] = {}
    for cell in results.cells():
        assert cell.score is not None
        lost[cell.label] = lost.get(cell.label, 0) + bool(cell.score.lost)
    assert min(lost.values()) <= 0.2 * SEEDS
    assert max(lost.values()) >= 0.2 * SEEDS

"""Bounds of a results file: computed once, of scenarios and recordings, in the bench's table and in the report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from bench_fakes import Walker
from command_line import Call

import irsim
from irtrack.bench import Entry, Results, run_bench
from irtrack.bench.bounds import bound_rows, compute_bounds
from irtrack.metrics.bound import TargetBound
from irtrack.report import write_report
from irtrack.report.figure_data import figures
from irtrack.report.formats import as_csv, as_json, as_markdown
from irtrack.report.plots import least_errors

SCENE = """
frames: 6
camera: {size: [64, 48], netd_mk: 40}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: point, contrast_k: 20}, path: {kind: straight, start: [20, 16], speed: 1, range_m: 3000}}
"""


def test_bounds_are_computed_once_and_kept(tmp_path: Path) -> None:
    scenario, counts = irsim.loads(SCENE), []
    with run_bench([scenario], [Entry("w", Walker(speed=1.1))], seeds=2, results=tmp_path / "r.db") as kept:
        cells = kept.cells()
        assert bound_rows(kept, cells) == []
        assert compute_bounds(kept, cells, lambda done, total: counts.append((done, total))) == []
        assert counts[-1] == (12, 12)
        assert compute_bounds(kept, cells, lambda done, total: counts.append((done, total))) == []
        assert len(counts) == 12
        (row,) = bound_rows(kept, cells)
        found = kept.bounds(cells[0].key.source_hash, "jet")
    expected = irsim.bounds(scenario)
    assert found is not None
    np.testing.assert_array_equal(found.sds, [(each.sd_x, each.sd_y) for each in expected])
    assert (row.source, row.label, row.figures.runs, row.figures.frames) == ("scenario", "w", 2, 10)
    assert row.figures.ratio is not None
    with Results(tmp_path / "r.db") as again:
        assert bound_rows(again, again.cells())[0].figures == row.figures


def test_recordings_give_their_channel_or_a_note(tmp_path: Path) -> None:
    rendering = irsim.Rendering(irsim.loads(SCENE))
    bounded = irsim.record(rendering, tmp_path / "with.mcap", bounds=irsim.FrameBounds(rendering.scenario).of)
    plain = irsim.record(rendering, tmp_path / "plain.mcap", 0, 5)
    sources = [irsim.open_recording(bounded), irsim.open_recording(plain)]
    with run_bench(sources, [Entry("w", Walker(speed=1.1))], results=tmp_path / "r.db") as kept:
        notes = compute_bounds(kept, kept.cells())
        rows = bound_rows(kept, kept.cells())
    assert notes == ["plain: no bounds: the recording holds none; allowed: a recording rendered with bounds"]
    assert [(row.source, row.figures.frames) for row in rows] == [("with", 5)]


def test_report_shows_errors_against_the_bound(tmp_path: Path) -> None:
    trackers = [Entry("w", Walker(speed=1.1))]
    with run_bench([irsim.loads(SCENE)], trackers, results=tmp_path / "r.db") as kept:
        plain = as_json(figures(kept, kept.cells()), [])
        compute_bounds(kept, kept.cells())
        page = write_report(kept, tmp_path / "r.html").read_text()
        found = figures(kept, kept.cells())
    assert "Error against the bound" in page
    assert "dotted: the least root mean square error" in page
    assert json.loads(as_json(found, []))["sources"][0]["bounds"]["w"]["frames"] == 5
    assert "bounds" not in json.loads(plain)["sources"][0]
    assert "| rms / bound |" in as_markdown(found)
    assert "bounds,scenario,w,,ratio," in as_csv(found)


def test_chart_draws_the_least_error() -> None:
    """The root mean square error of both axes, by groups of frames, not below the end of the axis."""
    frames, sds = np.arange(6), np.tile([0.3, 0.4], (6, 1))
    bounds = [TargetBound(frames, sds, np.full(6, 20.0)), TargetBound(frames[:2], sds[:2] / 1e3, np.full(2, 20.0))]
    np.testing.assert_allclose(least_errors(frames, bounds[:1], 4), [0.5, 0.5])
    np.testing.assert_allclose(least_errors(np.arange(8), bounds[1:]), [0.01] * 2 + [np.nan] * 6)


def test_the_command_prints_multiples_of_the_bound(bare_call: Call, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE)
    words = ("bench", "scene.yaml", "frames=3", "--trackers", "template", "--seeds", "1", "--results", "r.db")
    done = bare_call(*words, "--bounds")
    assert done.status == 0
    assert "rms / bound" in done.out
    found = json.loads(bare_call(*words, "--bounds", "--json").out)
    assert found["bounds"][0]["label"] == "template"


def test_faint_targets_have_no_ratio(tmp_path: Path) -> None:
    faint = irsim.loads(SCENE, overrides=["frames=3", "camera.netd_mk=400"])
    with run_bench([faint], [Entry("w", Walker(speed=0.0))], results=tmp_path / "r.db") as kept:
        assert compute_bounds(kept, kept.cells()) == []
        (row,) = bound_rows(kept, kept.cells())
    assert (row.figures.frames, row.figures.ratio) == (0, None)


def test_report_draws_the_error_over_the_bound(tmp_path: Path) -> None:
    """In a scene with enough frames in which the bound holds."""
    scene = irsim.change(irsim.loads(SCENE), {"frames": 40, "targets.jet.path.speed": 0.5})
    with run_bench([scene], [Entry("w", Walker(speed=0.5))], seeds=2, results=tmp_path / "r.db") as kept:
        assert "Error over the bound against d" not in write_report(kept, tmp_path / "r.html").read_text()
        compute_bounds(kept, kept.cells())
        page = write_report(kept, tmp_path / "r.html").read_text()
    assert "Error over the bound against d" in page
    assert 'aria-label="scenario: error over the bound"' in page

"""Summary of the truth of each target, against figures by hand."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.cli.truth_summary import FrameSpan, summarize
from irsim.types import Box, TargetTruth, Truth

SIZE = (64, 48)


def seen(visible: float | None = 1.0, scr: float | None = None, **rest: object) -> TargetTruth:
    return replace(TargetTruth("jet", (20.0, 20.0), Box(20, 20, 8, 4), visible=visible, scr=scr), **rest)  # type: ignore[arg-type]  # fields of any type


def test_hidden_spans_have_their_occluders() -> None:
    rows = [seen(), seen(0.2, occluders=("tree",)), seen(0.0, occluders=("tree", "house")), seen(0.5), None, seen(0.1)]
    (jet,) = summarize((Truth(k, k / 30, (row,) if row else ()) for k, row in enumerate(rows)), SIZE)
    assert jet.hidden == (FrameSpan(1, 2, ("tree", "house")), FrameSpan(5, 5))
    assert jet.absent == (FrameSpan(4, 4),)
    assert jet.crossing == ()
    assert (jet.frames, jet.first, jet.size) == (5, 0, (8.0, 4.0))


def test_targets_out_of_view_are_not_hidden() -> None:
    rows = [seen(0.0, in_view=False), seen(0.3, in_view=False, occluders=("tree",)), seen(0.2, in_view=True), seen()]
    (jet,) = summarize((Truth(k, k / 30, (row,)) for k, row in enumerate(rows)), SIZE)
    assert jet.outside == (FrameSpan(0, 1),)
    assert jet.hidden == (FrameSpan(2, 2),)


def test_targets_cut_by_the_edge_are_not_hidden() -> None:
    """They are hidden where there is an occluder, and where the box is inside the picture."""
    corner, edge = Box(2, 1, 8, 4), Box(61, 20, 8, 4)
    rows = [seen(0.4, box=corner), seen(0.45, box=edge), seen(0.3, box=corner, occluders=("tree",)), seen(0.3)]
    (jet,) = summarize((Truth(k, k / 30, (row,)) for k, row in enumerate(rows)), SIZE)
    assert jet.cut == (FrameSpan(0, 1),)
    assert jet.hidden == (FrameSpan(2, 3, ("tree",)),)
    assert jet.outside == ()


CORNERED = """
frames: 3
camera: {size: [80, 60], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets: [{id: jet, shape: {kind: fighter}, path: {kind: straight, start: [8, 2], speed: 0, range_m: 500}}]
"""


HIDDEN = """
frames: 8
camera: {size: [80, 60], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 30], speed: 4, range_m: 500}}]
occluders: [{kind: bar, range_m: 100, center_px: [24, 30], size_px: [8, 20]}]
"""


def test_scr_quantiles_and_median_speed() -> None:
    rows = [seen(scr=float(k), velocity=(3.0 * k, 4.0 * k)) for k in range(21)] + [seen(0.0, 1000.0)]
    (jet,) = summarize((Truth(k, k / 30, (row,)) for k, row in enumerate(rows)), SIZE)
    assert jet.scr == pytest.approx((1, 10, 19))
    assert jet.speed == pytest.approx(50)


def test_info_prints_decimal_numbers(tmp_path: Path) -> None:
    """3000 s and an SCR of hundreds, not 3e+03 s and 6e+02."""
    path = tmp_path / "scene.yaml"
    path.write_text(CORNERED.replace("netd_mk: 0", "rate_hz: 0.001, netd_mk: 20").replace("fighter", "point"))
    done = CliRunner().invoke(app, ["info", str(path)])
    assert done.exit_code == 0, done.output
    assert "frames     3 at 0.001 Hz, 3000 s" in done.stdout.splitlines()
    ratio = re.search(r"SCR (\d+) \((\d+) to (\d+)\)", done.stdout)
    assert ratio is not None, done.stdout
    assert int(ratio[1]) >= 100


def test_info_gives_the_reason_for_no_scr(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(HIDDEN)
    for override, why in (
        ("occluders.bar.size_px=[70, 20]", "hidden"),
        ("targets.jet.path.start=[-500, 30]", "outside"),
        ("targets.jet.path.speed=0", None),
    ):
        done = CliRunner().invoke(app, ["info", str(path), "camera.netd_mk=20", override])
        assert (f"no SCR: {why}" in done.stdout) == (why is not None), done.output
        assert (" SCR " in done.stdout.replace("no SCR", "")) == (why is None), done.output
    done = CliRunner().invoke(app, ["info", str(path)])
    assert "             more than half hidden in 3-4 by bar" in done.stdout.splitlines(), done.stdout

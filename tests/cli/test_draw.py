"""The sheet of `irsim show`."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure

import irsim
from irsim.cli.figures import _draw_frame, _overlap, contact_sheet, name_position, zoom_corner
from irsim.types import Box

SIZE = (200, 100)  # the enlarged part is 30 px wide and high


def test_enlarged_part_is_far_from_its_target() -> None:
    assert zoom_corner(Box(20, 20, 5, 5), [], SIZE) == (0.85, 0.0)
    assert zoom_corner(Box(180, 80, 5, 5), [], SIZE) == (0.0, 0.7)


def test_names_avoid_other_names() -> None:
    box, extent = Box(60, 50, 10, 10), (30.0, 8.0)
    above, below = Box.from_edges(50, 36, 90, 44), Box.from_edges(50, 56, 90, 64)
    assert name_position(box, extent, SIZE) == (55, 44)
    assert name_position(box, extent, SIZE, [above]) == (55, 64)
    assert name_position(box, extent, SIZE, [above, below]) == (66, 54)
    everywhere = [Box(100, 50, 200, 100)]
    assert name_position(box, extent, SIZE, everywhere) == (55, 44)


def test_names_of_a_swarm_cover_no_box() -> None:
    """Defect 19: names of targets close together lay over each other and over boxes."""
    source = irsim.open_source("swarm")
    figure = Figure(figsize=(3.6, 2.7))
    for index in (40, 42, 60, 75):
        axes = figure.add_axes((0, 0, 1, 1))
        truth = source.truth(index)
        assert truth is not None
        occupied = _draw_frame(axes, source.frame(index, "display"), truth, (0, 255), 1.3)
        boxes, names = occupied[::2], occupied[1::2]
        covered = [_overlap((name.left, name.bottom), (name.w, name.h), boxes) for name in names]
        among = [
            _overlap((name.left, name.bottom), (name.w, name.h), names[:k] + names[k + 1 :])
            for k, name in enumerate(names)
        ]
        assert len(names) == 7
        assert max(among) < 1
        assert sum(area > 1 for area in covered) <= 1  # two boxes that meet leave no free place
        axes.remove()


def test_sheet_has_axes_in_pixels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Defect 8: pixels for `--init` and `--region` are read off the sheet."""
    drawn: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, **more: drawn.append(figure))
    contact_sheet(irsim.open_source("sky", ["frames=2"]), tmp_path / "s.png")
    axes = drawn[0].axes[0]
    assert axes.axison
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, 319.5), (239.5, -0.5))
    shown = [float(label.get_text().replace("\N{MINUS SIGN}", "-")) for label in axes.get_xticklabels()]
    assert {0.0, 100.0, 300.0} <= set(shown)

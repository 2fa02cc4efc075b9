"""Lines of OBJ files that go on, and what editors write before the first."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mesh_files import BOX

from irsim.targets.meshfile import MeshError, read_mesh

CORNERS = ("0 0 0", "1 0 0", "0 1 0", "0 0 1")
STL = "solid\n{}endsolid\n".format(
    "".join(
        "facet\nouter loop\n" + "".join(f"vertex {CORNERS[each]}\n" for each in face) + "endloop\nendfacet\n"
        for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    )
)
"""A tetrahedron as text."""


def test_a_line_that_ends_in_a_backslash_goes_on(tmp_path: Path) -> None:
    whole, parted = tmp_path / "whole.obj", tmp_path / "parted.obj"
    whole.write_text(BOX)
    parted.write_text(BOX.replace("f 1 2 4 3", "f 1 2 \\\n  4 \\\n3"))
    for one, other in zip(
        (read_mesh(str(whole)).vertices, read_mesh(str(whole)).faces),
        (read_mesh(str(parted)).vertices, read_mesh(str(parted)).faces),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)
    parted.write_text(BOX.replace("f 5 7 8 6", "f 5 \\\n7 8 x"))
    with pytest.raises(MeshError, match=r"parted\.obj:10: 'x' is no corner"):
        read_mesh(str(parted))


@pytest.mark.parametrize("first", ["v 0 0 0\n", "# a box\n", "solid"])
def test_a_byte_order_mark_is_no_matter(first: str, tmp_path: Path) -> None:
    """Nor is the first line lost by it."""
    text, ending = (STL, ".stl") if first == "solid" else (first + BOX.removeprefix(first), ".obj")
    plain, marked = (tmp_path / f"{name}{ending}" for name in ("plain", "marked"))
    plain.write_text(text)
    marked.write_text(text, encoding="utf-8-sig")
    one, other = read_mesh(str(plain)), read_mesh(str(marked))
    np.testing.assert_array_equal(one.vertices, other.vertices)
    np.testing.assert_array_equal(one.faces, other.faces)

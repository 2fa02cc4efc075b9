"""Lines of OBJ files that go on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mesh_files import BOX

from irsim.shapes.meshfile import MeshError, read_mesh


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

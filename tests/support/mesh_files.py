"""Mesh files for tests: bodies of irsim written out by another library's hulls."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from irsim.targets.body import Body
from irsim.types import Floats

BOX = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1)) + (
    "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
)
"""The text of an OBJ file: a closed cube."""

GIVEN: dict[str, dict[str, Any]] = {
    "mesh": {"file": str(Path(__file__).parent / "wedge.obj"), "length_m": 10.0, "materials_k": {"stern": 400.0}}
}
"""Keys that a kind of target cannot do without."""


def triangles(body: Body, part: int) -> Floats:
    """(n, 3, 3) corners of the hull of a part, counter-clockwise from outside, body axes, lengths 1."""
    from scipy.spatial import ConvexHull

    points = np.array(body.solids[part].points)
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    wrong = np.sum(normals * hull.equations[:, :3], axis=1) < 0
    corners[wrong] = corners[wrong, ::-1]
    return np.asarray(corners)


def write_obj(path: Path, body: Body) -> Path:
    """A body at rest as OBJ, x forward and z up, a material for each of its heats."""
    lines = ["# a body of irsim"]
    count = 0
    for part, solid in enumerate(body.solids):
        corners = triangles(body, part) * [1, -1, -1]
        lines.append(f"usemtl {solid.material}")
        lines += ["v " + " ".join(f"{x:.9f}" for x in corner) for corner in corners.reshape(-1, 3)]
        for _ in corners:
            lines.append(f"f {count + 1}/1/1 {count + 2}//7 {count + 3}")
            count += 3
    path.write_text("\n".join(lines) + "\n")
    return path


def write_stl(path: Path, corners: Floats) -> Path:
    """Triangles (n, 3, 3) as binary STL."""
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *each.ravel().tolist(), 0) for each in corners)
    path.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + records)
    return path


def sphere(rings: int) -> Floats:
    """(n, 3, 3) triangles of a sphere of radius 1/2 with 2 rings longitudes, counter-clockwise from outside."""
    rise = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    turn = np.linspace(0, 2 * np.pi, 2 * rings + 1)
    x = np.cos(rise)[:, None] * np.cos(turn)
    y = np.cos(rise)[:, None] * np.sin(turn)
    points = np.stack([x, y, np.broadcast_to(np.sin(rise)[:, None], x.shape)], axis=-1) / 2
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    upper = np.stack([a[1:], b[1:], c[1:]], axis=2).reshape(-1, 3, 3)
    lower = np.stack([a[:-1], c[:-1], d[:-1]], axis=2).reshape(-1, 3, 3)
    return np.concatenate([upper, lower])

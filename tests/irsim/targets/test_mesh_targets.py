"""Bodies from mesh files: readers, refusals, and drawing as exact as that of built-in bodies."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_files import BOX, sphere, triangles, write_obj, write_stl
from pydantic import ValidationError
from target_views import AWAY, MIDDLE, body, centroid, context, drawn, on_frame, shape

from irsim.errors import InputError
from irsim.geometry.rotations import euler
from irsim.geometry.sprite import Sprite
from irsim.lint import lint
from irsim.physics.radiometry import radiance
from irsim.scenario.loader import loads
from irsim.targets import View
from irsim.targets.mesh import MeshShape
from irsim.targets.meshfile import MAX_FACES, MeshError, read_mesh

CUBE = "".join(f"v {x}\n" for x in ("0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1")) + (
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
)
TARGET = """frames: 2
background: {kind: sky}
targets:
  - id: own
    shape: {kind: mesh, file: nowhere.obj, length_m: 3}
    path: {kind: straight, start: [10, 10]}
"""


def pair(kind: str, tmp_path: Path, angles: Any) -> tuple[Sprite, Sprite]:
    """Return a body and the same body written to a file and read again, drawn in the same place."""
    value = body(kind, length_m=10.0)
    points = np.concatenate([np.array(solid.points) for solid in value.solids])
    low, high = points.min(axis=0), points.max(axis=0)
    path = write_obj(tmp_path / "body.obj", value)
    kelvin = {solid.material: getattr(value, solid.material) for solid in value.solids}
    value = body(kind, length_m=10.0, **({"windows_emissivity": 0.95} if "windows_k" in kelvin else {}))
    mesh = MeshShape(file=str(path), length_m=10.0 * float((high - low).max()), materials_k=kelvin)
    turn, place = AWAY @ euler(np.array(angles)), context().geometry.place(np.array(MIDDLE), 400.0)
    own = value.draw(View(place, turn, context()))
    read = mesh.draw(View(place + turn @ ((low + high) / 2 * 10.0), turn, context()))  # placed by its middle
    assert own is not None
    assert read is not None
    return own, read


@pytest.mark.parametrize("kind", ["fighter", "tank"])
def test_a_mesh_is_drawn_as_the_body_it_was_written_from(kind: str, tmp_path: Path) -> None:
    """The file holds hulls that touch and intersect each other.

    Of intersecting parts a body hides one as a whole, a mesh face by face: so light is compared only for a body without
    intersecting parts of different temperature.
    """
    rng = np.random.default_rng(3)
    for angles in [*rng.uniform(-180, 180, (2, 3)), (90, 0, 0), (45, 45, 0)]:
        own, read = pair(kind, tmp_path, angles)
        np.testing.assert_allclose(on_frame(read, read.cover), on_frame(own, own.cover), atol=2e-5)
        np.testing.assert_allclose(on_frame(read, read.alpha), on_frame(own, own.alpha), atol=2e-5)
        np.testing.assert_allclose(read.center, own.center, atol=1e-5)
        np.testing.assert_allclose(centroid(read, read.emission), read.signal_center, atol=1e-3)
    if kind == "fighter":
        own, read = pair(kind, tmp_path, (30, 10, 20))
        assert read.emission.sum() == pytest.approx(own.emission.sum(), rel=0.03)
        np.testing.assert_allclose(read.signal_center, own.signal_center, atol=0.25)


@pytest.mark.parametrize("angles", [(90, 0, 0), (97, -141, 161)])
def test_a_distant_mesh_keeps_its_light(angles: tuple[float, ...]) -> None:
    """Light times range squared, from a twentieth of a pixel to 30 px."""
    sizes, mesh = (0.05, 0.2, 0.5, 1, 2, 5, 30), shape("mesh")
    lights = [drawn(mesh, angles, range_m=10.0 / (px * 5e-4)).emission.sum() / px**2 for px in sizes]
    # Where its hot side is a sliver, 128 samples across give that side's share within some percent.
    np.testing.assert_allclose(lights, lights[-1], rtol=0.09)
    np.testing.assert_allclose(lights[:4], lights[0], rtol=0.01)


def test_a_sphere_has_the_area_of_a_disc(tmp_path: Path) -> None:
    # 10 m at 1000 m: 20 px across; a polygon of 100 corners holds 0.9993 of its circle.
    path = write_stl(tmp_path / "ball.stl", sphere(50))
    sprite = drawn(MeshShape(file=str(path), length_m=10.0), (30, 40, 50))
    assert sprite.cover.sum() == pytest.approx(np.pi * 100, rel=3e-3)
    glow = 0.95 * float(radiance("mwir", 300.0))
    np.testing.assert_allclose(sprite.emission, glow * sprite.alpha, rtol=1e-9, atol=1e-12)


def test_the_nearer_face_hides_the_farther(tmp_path: Path) -> None:
    """A cold cube of side 1 before the middle of a hot one of side 3: the hot one keeps 8 of 9 parts."""
    vertices = np.array([line.split()[1:] for line in CUBE.splitlines() if line[0] == "v"], float)
    faces = [line for line in CUBE.splitlines() if line[0] == "f"]
    near, far = (
        "".join("v {} {} {}\n".format(*point) for point in points.tolist())
        for points in (vertices - [2.0, 0.5, 0.5], 3 * vertices - [0.0, 1.5, 1.5])
    )
    path, negative = (
        tmp_path / "two.obj",
        [re.sub(r"\d", lambda corner: str(int(corner[0]) - 9), face) for face in faces],
    )
    path.write_text("\n".join(["usemtl cold", near, *negative, "usemtl hot", far, *negative]))
    mesh = MeshShape(file=str(path), length_m=5.0, materials_k={"cold": 250.0, "hot": 400.0}, emissivity=1.0)
    cold, hot = (float(radiance("mwir", kelvin)) for kelvin in (250.0, 400.0))
    # The near cube's face is (97.5 + 2) / 97.5 times as large as in the plane of the far one's.
    share = (99.5 / 97.5) ** 2 / 9
    for emissivity in (1.0, 0.4):
        dim = mesh.model_copy(update={"emissivities": {"hot": emissivity}})
        sprite = drawn(dim, (0, 0, 0), range_m=100.0, where=context(0.0))  # flies away: its low x is nearest
        mean = sprite.emission.sum() / sprite.alpha.sum()
        assert mean == pytest.approx(share * cold + (1 - share) * emissivity * hot, rel=5e-3)


def test_stl_text_and_binary_hold_the_same(tmp_path: Path) -> None:
    corners = triangles(body("tank"), 0)
    binary, text, marked = write_stl(tmp_path / "b.stl", corners), tmp_path / "t.stl", tmp_path / "m.stl"
    lines = ["solid t"]
    for each in corners:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in each)]
        lines += ["endloop", "endfacet"]
    text.write_text("\n".join([*lines, "endsolid t"]))
    marked.write_text(text.read_text(), encoding="utf-8-sig")
    for mesh in (read_mesh(str(path)) for path in (binary, text, marked)):
        found = np.sort(mesh.vertices[mesh.faces].reshape(-1, 3), axis=0)
        np.testing.assert_allclose(found, np.sort(corners.reshape(-1, 3), axis=0), atol=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        CUBE,
        re.sub(r"f (.) (.) (.) (.)", r"f \4 \3 \2 \1", CUBE),
        CUBE.replace("f 4 3 2 1", "f 4 3 \\\n  2 \\\n1"),
        "\ufeff" + CUBE,
    ],
    ids=["polygons", "inside out", "continued line", "byte order mark"],
)
def test_variants_of_obj_are_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "cube.obj"
    path.write_text(text, encoding="utf-8")
    # Its nearest face, 20 m wide, lies 990 m away, where a pixel of 0.5 mrad spans 0.495 m.
    sprite = drawn(MeshShape(file=str(path), length_m=20.0))
    assert sprite.cover.sum() == pytest.approx((20.0 / ((1000.0 - 10.0) * 5e-4)) ** 2, rel=1e-4)


FACET = b"solid x\nfacet normal 0 0 1\n"


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.obj", b"v 0 0 0\nv 1 b 0\n", ":2: '1 b 0' are not coordinates"),
        ("a.obj", b"v 0 0 0\n\nf 1 2 3\n", ":3: vertex 2 does not exist; allowed: 1 to 1"),
        ("a.obj", b"v 0 0 0\nf 1 1\n", ":2: corners of a face: 2"),
        ("a.obj", b"", "holds no faces; allowed: a closed surface of triangles"),
        ("a.obj", b"v 1 2 3\nf 1 1 1\n", "all its points coincide"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "encloses no volume"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", "not a number, or too large"),
        ("a.ply", b"ply", "allowed: .obj, .stl"),
        ("a.stl", b"solid of a binary file".ljust(80, b"\0") + b"\x02\0\0\0" + bytes(90), "50 for each of its 2 tri"),
        ("a.stl", FACET + b"outer loop\n" + b"vertex 1 2 3\n" * 3 + b"endloop\nendfac", "within the facet of line 2"),
        ("a.stl", FACET + b"vertex 1 2 3\nvertex 1 2", ":4: coordinates of a vertex: 2;"),
        ("big.stl", None, f"at most {MAX_FACES}"),
    ],
)
def test_an_unreadable_mesh_gives_one_line(tmp_path: Path, name: str, data: bytes | None, words: str) -> None:
    path = tmp_path / name
    if data is None:
        write_stl(path, np.tile(sphere(10), (200, 1, 1)))
    else:
        path.write_bytes(data)
    with pytest.raises(MeshError, match=r"^[^\n]*$") as caught:
        read_mesh(str(path))
    assert str(caught.value).startswith(f"{path}:")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "edges"), [("f 4 1 5 8\n", "", 4), ("f 5 6 7 8\n", "f 8 7 6 5\n", 4), ("f", "f", 0)]
)
def test_an_open_surface_is_warned_of(tmp_path: Path, old: str, new: str, edges: int) -> None:
    path = tmp_path / "own.obj"
    path.write_text(CUBE.replace(old, new))
    notices = [each for each in lint(loads(TARGET.replace("nowhere.obj", str(path)))) if each.at[-1] == "file"]
    assert [notice.at for notice in notices] == [("targets", 0, "shape", "file")] * bool(edges)
    assert all(f"not a closed surface: at {edges} of its edges" in notice.message for notice in notices)


def test_another_mesh_is_another_scenario(tmp_path: Path) -> None:
    path = tmp_path / "own.stl"
    hashes = [loads(TARGET.replace("nowhere.obj", str(write_stl(path, sphere(rings))))).hash for rings in (6, 8)]
    assert hashes[0] != hashes[1]


def test_a_wrong_file_or_material_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"5:\d+: .*nowhere.obj: there is no such file"):
        loads(TARGET)
    path = tmp_path / "box.obj"
    path.write_text("usemtl engine_k\n" + BOX)
    for wrong in ({"materials_k": {"engine": 500.0}}, {"emissivities": {"engine": 0.5}}):
        with pytest.raises(ValidationError, match=r"no material 'engine'.*did you mean 'engine_k'"):
            MeshShape.model_validate({"file": str(path), "length_m": 3.0, **wrong})

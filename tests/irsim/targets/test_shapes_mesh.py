"""Bodies from mesh files: read, refused, and drawn as exactly as irsim's own."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_files import sphere, triangles, write_obj, write_stl
from pydantic import ValidationError
from test_shapes import AWAY, context, middle, seen, shape

from irsim.errors import InputError
from irsim.geometry.sprite import Sprite
from irsim.lint import doubts
from irsim.motion.attitude import euler
from irsim.physics.radiometry import radiance
from irsim.scenario.loader import loads
from irsim.targets import View
from irsim.targets.body import Body
from irsim.targets.meshfile import MOST_FACES, MeshError, read_mesh
from irsim.targets.model import Model
from irsim.types import Floats

CUBE = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""


def body(kind: str, **keys: Any) -> Body:
    value = shape(kind, **keys)
    assert isinstance(value, Body)
    return value


def extent(value: Body) -> tuple[float, Any]:
    """The longest side of a body of length 1, and the middle of its extent."""
    points = np.concatenate([np.array(solid.points) for solid in value.solids])
    low, high = points.min(axis=0), points.max(axis=0)
    return float((high - low).max()), (low + high) / 2


def pair(kind: str, tmp_path: Path, angles: Any) -> tuple[Sprite, Sprite]:
    """A body, and the same written to a file and read again, seen in the same place."""
    value = body(kind, length_m=10.0)
    longest, center = extent(value)
    path = write_obj(tmp_path / "body.obj", value)
    heats = {solid.heat: getattr(value, solid.heat) for solid in value.solids}
    value = body(kind, length_m=10.0, **({"windows_emissivity": 0.95} if "windows_k" in heats else {}))
    model = Model(file=str(path), length_m=10.0 * longest, materials_k=heats)
    turn = AWAY @ euler(np.array(angles))
    place = context().geometry.place(np.array([79.5, 59.5]), 400.0)
    own = value.draw(View(place, turn, context()))
    read = model.draw(
        View(place + turn @ (center * 10.0), turn, context())
    )  # a mesh lies about the middle of its extent
    assert own is not None
    assert read is not None
    return own, read


def frame(sprite: Sprite, cells: Floats) -> Floats:
    """A sprite's array in its place in the frame."""
    picture = np.zeros((120, 160))
    rows, columns = cells.shape
    picture[sprite.y0 : sprite.y0 + rows, sprite.x0 : sprite.x0 + columns] = cells
    return picture


@pytest.mark.parametrize("kind", ["fighter", "tank", "car", "boat"])
class TestAgainstBodies:
    """A body as a file is a soup of hulls that meet and run through each other."""

    def test_the_outline_is_the_same(self, kind: str, tmp_path: Path) -> None:
        rng = np.random.default_rng(3)
        for angles in [*rng.uniform(-180, 180, (8, 3)), (90, 0, 0), (0, 0, 0), (180, 0, 0), (45, 45, 0)]:
            own, read = pair(kind, tmp_path, angles)
            np.testing.assert_allclose(frame(read, read.cover), frame(own, own.cover), atol=2e-5)
            np.testing.assert_allclose(frame(read, read.alpha), frame(own, own.alpha), atol=2e-5)
            np.testing.assert_allclose(read.center, own.center, atol=1e-5)


@pytest.mark.parametrize("kind", ["fighter", "boat"])
def test_faces_are_as_bright_as_a_body_s_parts(kind: str, tmp_path: Path) -> None:
    """Faces are told apart at points 1/6 px apart. Of parts that run through each other a body hides one as a whole,
    a mesh face by face: so only bodies whose parts of unlike temperature do not."""
    for angles in [(90, 0, 0), (30, 10, 20), (150, -20, 0)]:
        own, read = pair(kind, tmp_path, angles)
        assert read.emission.sum() == pytest.approx(own.emission.sum(), rel=0.03)
        np.testing.assert_allclose(read.signal_center, own.signal_center, atol=0.25)
        np.testing.assert_allclose(middle(read, read.emission), read.signal_center, atol=1e-3)


@pytest.mark.parametrize("angles", [(90, 0, 0), (30, 20, 10), (97, -141, 161), (200, 30, -60)])
def test_a_far_mesh_of_unlike_temperatures_keeps_its_light(angles: tuple[float, ...]) -> None:
    """Light times range squared, from a twentieth of a pixel to 30 px, 333,333 to 556 lengths away."""
    model = shape("mesh")
    lights = [
        seen(model, angles, range_m=10.0 / (px * 5e-4)).emission.sum() / px**2 for px in (0.05, 0.2, 0.5, 1, 2, 5, 30)
    ]
    # Turned so that its hot side is a sliver, 128 points across tell that side's share within some percent.
    np.testing.assert_allclose(lights, lights[-1], rtol=0.09)
    np.testing.assert_allclose(lights[:4], lights[0], rtol=0.01)


def ball(tmp_path: Path, rings: int, **keys: Any) -> Model:
    return Model(file=str(write_stl(tmp_path / "ball.stl", sphere(rings))), length_m=10.0, **keys)


def test_a_sphere_has_the_area_of_a_disc(tmp_path: Path) -> None:
    # 10 m at 1000 m: 20 px across; 9,800 faces; a polygon of 100 corners holds 0.9993 of its circle.
    model = ball(tmp_path, 50)
    assert len(read_mesh(model.file).faces) == 9800
    for angles in ((0, 0, 0), (30, 40, 50)):
        sprite = seen(model, angles, range_m=1000.0)
        assert sprite.cover.sum() == pytest.approx(np.pi * 100, rel=3e-3)
        glow = 0.95 * float(radiance("mwir", 300.0))
        np.testing.assert_allclose(sprite.emission, glow * sprite.alpha, rtol=1e-9, atol=1e-12)


def test_the_nearer_face_hides_the_farther_one(tmp_path: Path) -> None:
    """A cold cube of 1 before the middle of a hot one of 3: of 9 parts of the picture the hot one keeps 8."""
    near = [line if line[0] == "f" else "v " + " ".join(map(str, _moved(line))) for line in CUBE.splitlines()]
    far = [_later(line) if line[0] == "f" else "v " + " ".join(map(str, _large(line))) for line in CUBE.splitlines()]
    path = tmp_path / "two.obj"
    path.write_text("\n".join(["usemtl cold", *near, "usemtl hot", *far]) + "\n")
    model = Model(file=str(path), length_m=5.0, materials_k={"cold": 250.0, "hot": 400.0}, emissivity=1.0)
    sprite = seen(model, (0, 0, 0), range_m=5000.0, psf_px=0.0)  # flies away: its low x are nearest
    glow = [float(radiance("mwir", kelvin)) for kelvin in (250.0, 400.0)]
    side = 3.0 / (5000.0 * 5e-4)
    assert sprite.cover.sum() == pytest.approx(side**2, rel=3e-3)
    hot_on_a_fine_grid = seen(model, (0, 0, 0), range_m=100.0, psf_px=0.0)
    mean = hot_on_a_fine_grid.emission.sum() / hot_on_a_fine_grid.alpha.sum()
    # The near cube's face is (97.5 + 2) / 97.5 times as large as it would be in the plane of the far one's.
    share = (99.5 / 97.5) ** 2 / 9
    assert mean == pytest.approx(share * glow[0] + (1 - share) * glow[1], rel=5e-3)
    dim = seen(model.model_copy(update={"emissivities": {"hot": 0.4}}), (0, 0, 0), range_m=100.0, psf_px=0.0)
    mean = dim.emission.sum() / dim.alpha.sum()
    assert mean == pytest.approx(share * glow[0] + (1 - share) * 0.4 * glow[1], rel=5e-3)


def _moved(line: str) -> list[float]:
    x, y, z = map(float, line.split()[1:])
    return [x - 2.0, y - 0.5, z - 0.5]


def _large(line: str) -> list[float]:
    return [3 * float(word) - (0.0 if axis == 0 else 1.5) for axis, word in enumerate(line.split()[1:])]


def _later(line: str) -> str:
    return "f " + " ".join(str(int(word) + 8) for word in line.split()[1:])


def test_a_mesh_follows_a_hundredth_of_a_pixel(tmp_path: Path) -> None:
    model = Model(
        file=str(write_obj(tmp_path / "jet.obj", body("fighter"))), length_m=15.0, materials_k={"engine_k": 500}
    )
    for x in np.arange(60.0, 61.0, 0.13):
        here, there = (seen(model, (50, 20, 30), (x + d, 40.2), 4000.0) for d in (0.0, 0.01))
        np.testing.assert_allclose(np.subtract(there.center, here.center), [0.01, 0], atol=3e-5)
        np.testing.assert_allclose(middle(here, here.alpha), here.center, atol=1e-3)
        np.testing.assert_allclose(middle(here, here.emission), here.signal_center, atol=1e-3)


def test_text_and_binary_stl_and_obj_hold_the_same(tmp_path: Path) -> None:
    corners = triangles(body("tank"), 0)
    binary = write_stl(tmp_path / "b.stl", corners)
    text = tmp_path / "t.stl"
    lines = ["solid t"]
    for each in corners:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in each)]
        lines += ["endloop", "endfacet"]
    text.write_text("\n".join([*lines, "endsolid t"]))
    for one in (read_mesh(str(binary)), read_mesh(str(text))):
        np.testing.assert_allclose(
            np.sort(one.vertices[one.faces].reshape(-1, 3), axis=0), np.sort(corners.reshape(-1, 3), axis=0), atol=1e-6
        )


def test_polygons_and_inside_out_files_are_read(tmp_path: Path) -> None:
    path, turned = tmp_path / "cube.obj", tmp_path / "turned.obj"
    path.write_text(CUBE)
    lines = [line.split() for line in CUBE.splitlines()]
    turned.write_text("\n".join(" ".join([word, *(reversed(rest) if word == "f" else rest)]) for word, *rest in lines))
    # Its nearest face, 20 m wide, lies 990 m away, where a pixel of 0.5 mrad sees 0.495 m.
    for file in (path, turned):
        sprite = seen(Model(file=str(file), length_m=20.0), range_m=1000.0)
        assert sprite.cover.sum() == pytest.approx((20.0 / ((1000.0 - 10.0) * 5e-4)) ** 2, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("v 0 0\n", 1, "coordinates of a vertex: 2; allowed: three"),
        ("v 0 0 0\nv 1 b 0\n", 2, "no coordinates"),
        ("v 0 0 0\n\nf 1 2 3\n", 3, "vertex 2 does not exist; allowed: 1 to 1"),
        ("v 0 0 0\nf 1 1\n", 2, "corners of a face: 2"),
        ("v 0 0 0\nf a b c\n", 2, "'a' is no corner"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    path = tmp_path / "bad.obj"
    path.write_text(text)
    with pytest.raises(MeshError, match=r"^[^\n]*$") as caught:
        read_mesh(str(path))
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.obj", b"", "holds no faces; allowed: a closed surface of triangles, in .obj by lines such as 'f 1 2 3'"),
        ("a.stl", b"solid x\nendsolid x\n", "holds no faces; allowed: a closed surface of triangles, in"),
        ("a.obj", b"v 1 2 3\nf 1 1 1\n", "all its points are one; allowed: a closed surface, whose points lie apart"),
        ("a.ply", b"ply", "allowed: .obj, .stl"),
        ("a.stl", b"\x00" * 90, "no STL file"),
        ("a.stl", b"solid x\nfacet normal 0 0 1\nvertex 1 2 3\nendfacet\n", "without three vertices"),
        (
            "a.stl",
            b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 1 2 4\nvertex 1 3 4\nendloop\nendfac",
            "a.stl:8: ends within the facet of line 2; allowed: facets of three vertices, each up to its endfacet",
        ),
        ("a.stl", b"solid x\nfacet normal 0 0 1\nvertex 1 2 3\nvertex 1 2", "a.stl:4: coordinates of a vertex: 2;"),
        (
            "a.stl",
            b"solid x\nfacet normal 0 0 1\nvertex 1 2 3\nvertex 1 2 4",
            "a.stl:4: ends within the facet of line 2",
        ),
        ("a.stl", b"solid of a binary file".ljust(80, b"\0") + b"\x02\0\0\0" + bytes(90), "50 for each of its 2 tri"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "encloses no volume"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", "no number, or too large"),
        ("a.obj", b"v 1e308 0 0\nv -1e308 0 0\nv 0 1e308 0\nf 1 2 3\n", "no number, or too large"),
    ],
)
def test_other_faults_are_one_line(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(MeshError, match=r"^[^\n]*$") as caught:
        read_mesh(str(path))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "edges"),
    [("f 4 1 5 8\n", "", 4), ("f 5 6 7 8\n", "f 8 7 6 5\n", 4), ("f 5 6 7 8\n", "f 5 6 7\n", 3), ("f", "f", 0)],
)
def test_a_surface_that_is_not_closed_is_warned_of(tmp_path: Path, old: str, new: str, edges: int) -> None:
    path = tmp_path / "own.obj"
    path.write_text(CUBE.replace(old, new))
    said = [notice for notice in doubts(loads(TARGET.replace("nowhere.obj", str(path)))) if notice.at[-1] == "file"]
    assert [notice.at for notice in said] == [("targets", 0, "shape", "file")] * bool(edges)
    assert all(f"no closed surface: at {edges} of its edges" in notice.message for notice in said)


def test_too_many_faces_are_refused(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "big.stl", np.tile(sphere(10), (200, 1, 1)))
    with pytest.raises(MeshError, match=f"at most {MOST_FACES}"):
        read_mesh(str(path))


def test_another_mesh_is_another_scene(tmp_path: Path) -> None:
    path = tmp_path / "own.stl"
    hashes = set()
    for rings in (6, 8):
        write_stl(path, sphere(rings))
        os.utime(path, ns=(0, rings))
        hashes.add(loads(TARGET.replace("nowhere.obj", str(path))).hash)
    assert len(hashes) == 2


TARGET = """frames: 2
background: {kind: sky}
targets:
  - id: own
    shape: {kind: mesh, file: nowhere.obj, length_m: 3}
    path: {kind: straight, start: [10, 10]}
"""


def test_a_scenario_names_the_place(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"5:\d+: .*nowhere.obj: there is no such file"):
        loads(TARGET)
    path = write_obj(tmp_path / "jet.obj", body("fighter"))
    with pytest.raises(ValidationError, match=r"no material 'engine'.*did you mean 'engine_k'"):
        Model(file=str(path), length_m=3.0, materials_k={"engine": 500.0})
    with pytest.raises(ValidationError, match=r"no material 'engine'.*did you mean 'engine_k'"):
        Model(file=str(path), length_m=3.0, emissivities={"engine": 0.5})

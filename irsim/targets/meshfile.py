"""Readers of triangle meshes: Wavefront OBJ, and STL as text or binary."""

from __future__ import annotations

import codecs
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from irsim.config.paths import Stamp, is_irregular, stamp
from irsim.types import Floats

MAX_FACES = 20_000
"""Largest number of triangles of a mesh: the drawing time is about proportional to it."""
MAX_COORDINATE = 1e12
"""Largest coordinate of a mesh, in any unit: squares and cubes of larger ones overflow."""
MAX_CACHED = 64
"""Number of meshes kept in memory."""


class MeshError(ValueError):
    """Error for an unreadable mesh: one line with the file and, in text files, the line number."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangle mesh.

    vertices  (V, 3)
    faces     (F, 3) vertex numbers, counter-clockwise as seen from outside
    group     (F,) material group of each face
    groups    names of the groups
    digest    of the file
    gaps      number of edges where the surface is open or its faces are inconsistently oriented
    """

    vertices: Floats
    faces: npt.NDArray[np.int64]
    group: npt.NDArray[np.int64]
    groups: tuple[str, ...]
    digest: str
    gaps: int


def read_mesh(path: str) -> Triangles:
    """Return the mesh in a file, re-read if the file changed. Raises MeshError if it is unreadable."""
    if is_irregular(path):  # such as a pipe without end
        raise MeshError(f"{path}: is no regular file; allowed: a mesh, .obj or .stl")
    try:
        return _read(path, stamp(path))
    except FileNotFoundError:
        raise MeshError(f"{path}: there is no such file") from None
    except OSError as error:
        raise MeshError(f"{path}: cannot be read: {error.strerror or error}") from None


@lru_cache(maxsize=MAX_CACHED)
def _read(path: str, stamp: Stamp) -> Triangles:
    reader = {".obj": _obj, ".stl": _stl}.get(Path(path).suffix.lower())
    if reader is None:
        raise MeshError(f"{path}: unknown kind of mesh; allowed: .obj, .stl")
    data = Path(path).read_bytes()
    corners, faces, group, names = reader(path, data)
    if not len(faces):
        raise MeshError(
            f"{path}: holds no faces; allowed: a closed surface of triangles, in .obj by lines such as 'f 1 2 3', in "
            ".stl by facets"
        )
    if len(faces) > MAX_FACES:
        raise MeshError(f"{path}: has {len(faces)} triangles; allowed: at most {MAX_FACES}")
    if not np.abs(corners).max() <= MAX_COORDINATE:  # nan, too
        raise MeshError(f"{path}: a coordinate is not a number, or too large; allowed: up to {MAX_COORDINATE:g}")
    # Coincident vertices are merged, so that adjacent faces share edges (in STL each face has its own corners).
    size = float(np.ptp(corners, axis=0).max())
    if not size > 0:
        raise MeshError(f"{path}: all its points coincide; allowed: a closed surface")
    _, first, merged = np.unique(np.round(corners / size, 7), axis=0, return_index=True, return_inverse=True)
    vertices, faces = corners[first], merged.reshape(-1)[faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces, group = faces[whole], group[whole]
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    volume = float(np.sum(a * np.cross(b, c)))
    if abs(volume) < 1e-9 * size**3:
        raise MeshError(f"{path}: encloses no volume; allowed: a closed surface")
    if volume < 0:
        faces = faces[:, ::-1]
    return Triangles(vertices, faces, group, names, hashlib.blake2b(data, digest_size=16).hexdigest(), _gaps(faces))


def _gaps(faces: npt.NDArray[np.int64]) -> int:
    """Return the number of edges that the faces beside them do not traverse equally often in both directions."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    ways = np.bincount(which.reshape(-1), weights=np.sign(edges[:, 1] - edges[:, 0]))
    return int(np.count_nonzero(ways))


_Parsed = tuple[Floats, npt.NDArray[np.int64], npt.NDArray[np.int64], tuple[str, ...]]


def _obj(path: str, data: bytes) -> _Parsed:
    """Return vertices and faces (polygons as fans) of an OBJ file, grouped by material, else by group or object."""
    corners: list[tuple[float, ...]] = []
    faces: list[tuple[int, int, int]] = []
    group: list[int] = []
    names: dict[str, int] = {}
    by_material = b"usemtl" in data
    current = ""
    for number, line in _obj_lines(data.decode("utf-8-sig", errors="replace")):
        word, *rest = line.partition("#")[0].split() or [""]
        try:
            if word == "v":
                corners.append(_three_numbers(rest[:3]))
            elif word == "f":
                ring = [_vertex_index(each, len(corners)) for each in rest]
                if len(ring) < 3:
                    raise ValueError(f"corners of a face: {len(ring)}; allowed: three or more")
                faces += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
                group += [names.setdefault(current, len(names))] * (len(ring) - 2)
            elif word == "usemtl" or (word in ("g", "o") and not by_material):
                current = " ".join(rest)
        except ValueError as error:
            raise MeshError(f"{path}:{number}: {error}") from None
    vertices, indices = np.array(corners, np.float64).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)
    return vertices, indices, np.array(group, np.int64), tuple(names)


def _obj_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield lines with their numbers from 1; a backslash at the end continues a line."""
    begun, first = "", 1
    for number, line in enumerate([*text.splitlines(), ""], start=1):
        first = first if begun else number
        begun += line
        if begun.endswith("\\"):
            begun = begun[:-1] + " "
        else:
            yield first, begun
            begun = ""


def _three_numbers(words: list[str]) -> tuple[float, ...]:
    if len(words) != 3:
        raise ValueError(f"coordinates of a vertex: {len(words)}; allowed: three")
    try:
        return tuple(float(word) for word in words)
    except ValueError:
        raise ValueError(f"{' '.join(words)!r} are not coordinates; allowed: three numbers") from None


def _vertex_index(word: str, count: int) -> int:
    """Return the vertex number, from 0, of a corner such as 3, 3/1, 3//2 or -1."""
    try:
        number = int(word.partition("/")[0])
    except ValueError:
        raise ValueError(f"{word!r} is not a corner; allowed: a vertex number") from None
    if not (1 <= number <= count or 1 <= -number <= count):
        raise ValueError(f"vertex {number} does not exist; allowed: 1 to {count}")
    return number - 1 if number > 0 else count + number


def _stl(path: str, data: bytes) -> _Parsed:
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        records = np.frombuffer(data, dtype=np.dtype([("f", "<f4", (4, 3)), ("a", "<u2")]), offset=84)
        return _unindexed(records["f"][:, 1:].reshape(-1, 3).astype(np.float64))
    text = data.removeprefix(codecs.BOM_UTF8)
    # The header of a binary file may begin with 'solid' too, but text holds no zero byte.
    if not text.lstrip().startswith(b"solid") or b"\0" in text:
        raise MeshError(
            f"{path}: {len(data)} bytes are not an STL file; allowed: 84 and 50 for each of its {count} triangles"
        )
    corners, open_at, number = [], 0, 0
    for number, line in enumerate(text.decode("utf-8", errors="replace").splitlines(), start=1):
        word, *rest = line.split() or [""]
        if word in ("facet", "endfacet", "endsolid"):
            if open_at and word != "endfacet":
                break
            open_at = number if word == "facet" else 0
        if word == "vertex":
            try:
                corners.append(_three_numbers(rest))
            except ValueError as error:
                raise MeshError(f"{path}:{number}: {error}") from None
        elif word == "endfacet" and len(corners) % 3:
            raise MeshError(f"{path}:{number}: a facet ends without three vertices")
    if open_at or len(corners) % 3:
        raise MeshError(
            f"{path}:{number}: ends within the facet of line {open_at or number}; "
            "allowed: facets of three vertices, each up to its endfacet (was the file cut short?)"
        )
    return _unindexed(np.array(corners, dtype=np.float64).reshape(-1, 3))


def _unindexed(corners: Floats) -> _Parsed:
    faces = np.arange(len(corners), dtype=np.int64).reshape(-1, 3)
    return corners, faces, np.zeros(len(faces), dtype=np.int64), ("",)

"""Kernels in C. Arrays are C-contiguous and of the types given; results are written to arguments."""

from typing import NewType

import numpy as np
import numpy.typing as npt

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.floating]
Int64 = npt.NDArray[np.int64]
Counts = npt.NDArray[np.uint16]
Words = npt.NDArray[np.int16]
Form = NewType("Form", object)
"""Checked tables of a body at rest."""
Spread = NewType("Spread", object)
"""Spread of the cells of a pixel over pixels."""

MOST_ADDED: int
"""Arrays that `counts_of` adds to a signal, at most."""

def signal_of(
    light: Float32,
    out: Float32,
    linear: float,
    root: float,
    zero: float,
    most: float,
    gain: Words | None,
    unit: float,
    /,
) -> None:
    """out = s + (s - zero) unit gain, at most `most`, where s = linear light + root sqrt(light) + zero; with a root,
    light below 0 counts as 0. `out` may be the light itself."""

def counts_of(
    signal: Float32,
    out: Counts,
    scale: float,
    offset: float,
    full: int,
    past: bool,
    down: Float32 | None,
    across: Float32 | None,
    /,
    *added: Words | float,
) -> None:
    """out = scale (signal + sum of what is added) + offset, rounded to the nearest (halves to even), clipped to
    0 .. full. A number is added for each row, `down`, and column, `across`, unless both are None, and up to MOST_ADDED
    arrays, each followed by its weight. past: write past the caches, for counts that are read much later."""

def mixed(
    shares: tuple[float, ...],
    scales: tuple[float, float],
    side: int,
    row: int,
    column: int,
    first: Float32,
    second: Float32,
    pair0: Float32,
    pair1: Float32,
    pair2: Float32,
    pair3: Float32,
    /,
) -> None:
    """first, second = the sums of the two fields in each of four pairs (side, side, 2) times their shares, times the
    scales, from a row and a column on; periodic. Rows may lie apart."""

def cloud(
    thickness: Float32,
    warmth: Float32,
    lit: Float32 | None,
    edge: float,
    depth: float,
    sunlit: float,
    glow: Float32,
    step: float,
    middle: float,
    passed: Float32,
    emitted: Float32,
    /,
) -> None:
    """Compute transmittance and emission by `irsim.backgrounds.clouds.CloudShading`; places in
    the table of glow are warmth * step + middle."""

def moved(
    early_share: int,
    right_of_early_share: int,
    late_share: int,
    right_of_late_share: int,
    down: float,
    unit: float,
    out: Float32,
    early: Words,
    late: Words,
    /,
) -> None:
    """out = a field mixed of two states, unit (word + 32768) for each of their words (rows + 1, columns + 1), and read
    `down` px, 0 to 1, below its first row. The shares of a word and of the one right of it, in either state, are whole
    numbers that sum to 32768. Rows may lie apart."""

def veil(
    under: Float32,
    early_share: int,
    right_of_early_share: int,
    late_share: int,
    right_of_late_share: int,
    down: float,
    unit_passed: float,
    unit_emitted: float,
    light: Float32,
    early_passed: Words,
    late_passed: Words,
    early_emitted: Words,
    late_emitted: Words,
    tau: Float32 = ...,
    path: Float32 = ...,
    /,
) -> None:
    """light = under passed + emitted, of such fields; what is under may be the light itself. tau, path: what the air
    before them passes, and its own light, both or neither: (under - path) passed + tau emitted + path."""

# Kernels that draw unit normals and use each at once; see `irsim.rng`.

def add_normals(seed: bytes, table: Words, deep: Float64, refined: int, signal: Float32, scale: float, /) -> None:
    """signal += scale normal."""

def add_shot(
    seed: bytes, table: Words, deep: Float64, refined: int, signal: Float32, variance: float, well: float, few: float, /
) -> bytes:
    """signal += normal sqrt(signal + variance), without the signal where it is `well` or more, or less than `few`;
    return those below `few`: pairs of float64, flat index and signal before."""

def bridge(
    seed: bytes,
    table: Words,
    deep: Float64,
    refined: int,
    before: Words,
    after: Words,
    weight: float,
    spread: float,
    out: Words,
    /,
) -> None:
    """out = weight (before + after) + spread normal, rounded to the nearest (halves to even); what 16 bits do not hold
    is the least or the greatest that they do."""

def lay(
    light: Float32, columns: int, alpha: Float64, emission: Float64, wide: int, x: int, y: int, /
) -> tuple[float, float, float]:
    """light <- light (1 - alpha) + emission, in a patch of `wide` columns whose top left is (x, y). Return the sums of
    alpha, emission, and alpha * the light before, within the picture."""

def clutter(
    picture: Float32, columns: int, cx: float, cy: float, w: float, h: float, ring: float, guard: float, /
) -> tuple[float, float, float]:
    """Return the mean of a box less that of its ring, and the ring's mean and standard deviation; nan where one of them
    lies outside the picture. See `irsim.render.contrast`."""

def form(
    firsts: Int64,
    corner: Int64,
    edges: Int64,
    heat: Int64,
    vertices: Float64,
    normals: Float64,
    offsets: Float64,
    crossing: Float64,
    thin: float,
    joint: Int64,
    /,
) -> Form:
    """Return the tables of `Mesh` and the joint of each part, -1 for none; ValueError where they do not agree."""

def spread(weights: Float64, shares: Float64, fine: int, /) -> Spread:
    """Return the spread by weights (terms,) and shares (terms, 2, fine, 2 reach + 1), see `PSF.separable_kernels`."""

def body_light(
    form: Form,
    motions: tuple[tuple[float, ...], ...],
    scale: float,
    position: Float64,
    attitude: Float64,
    ifov: float,
    columns: int,
    rows: int,
    shift_x: float,
    shift_y: float,
    shine: Float64,
    brightness: float,
    spreads: tuple[tuple[float, Spread], ...],
    /,
) -> (
    tuple[
        int,
        int,
        tuple[int, int, int],
        bytearray,
        tuple[float, float],
        tuple[float, float],
        tuple[float, float, float, float],
        float,
        float,
    ]
    | None
):
    """Return a body's light in a frame: x0, y0, shape and float64 values of cover, alpha and emission, the centroids of
    its area and of its light, its box, range and area; see `Sprite`. motions: twelve numbers of each joint; spreads:
    each with the largest side, px, that it is for. None where a part of the body is behind the camera."""

def sprite_light(
    start: Float64,
    stop: Float64,
    layer: Int64,
    glow: Float64,
    left: float,
    top: float,
    rows: int,
    columns: int,
    spread: Spread,
    light: Float64,
    /,
) -> tuple[float, float, float, float, float, float]:
    """Draw convex polygons that hide each other on pixels from the outer corner (left, top) px on, to light (3, rows +
    2 reach, columns + 2 reach) of cover, alpha and emission. Return area, signal, and x, y of either's centroid."""

def histogram(counts: Counts, pixels: Int64, /) -> None:
    """pixels[k] = number of counts k; counts beyond are left out."""

def recursive(filtered: Float32, counts: Counts, columns: int, gain: float, slope: float, out: Float32, /) -> None:
    """out = filtered + min(gain + slope |sum of 3x3 changes|, 1) change, where change = counts - filtered, in rows of
    `columns`; rows and columns at the border are repeated."""

def enhance(counts: Float32, slope: Float32, offset: Float32, columns: int, most: float, out: Counts, /) -> None:
    """out = counts slope + offset, clipped to 0 .. most and rounded, halves up. Slope and offset have fewer rows of
    `columns`, and are interpolated between them."""

"""Inner loops in C, where a compiler was at hand. Arrays are C-contiguous and of the types given."""

import numpy as np
import numpy.typing as npt

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.floating]
Int64 = npt.NDArray[np.int64]

def normals(state: bytes, table: Float32, refined: int, out: Float32, /) -> bytes:
    """Fill `out` with unit normals from the table by the 16-bit words of an SFC64 generator in a state.

    Those of the `refined` cells at either end are 0. Of them the bytes tell, 64 bits each: place, word +
    refined (mod 2^16), and a further word of the generator.
    """

def sprite_light(
    start: Float64,
    stop: Float64,
    layer: Int64,
    glow: Float64,
    left: float,
    top: float,
    fine: int,
    margin: int,
    weights: Float64,
    first_down: Int64,
    down: Float64,
    first_across: Int64,
    across: Float64,
    light: Float64,
    /,
) -> tuple[float, float, float, float, float, float]:
    """Convex polygons that hide each other, drawn on cells from (left, top) px on: `light` takes (3, rows, columns)
    of cover, alpha and emission. Area, signal, x and y of the area's centroid, and of the signal's."""

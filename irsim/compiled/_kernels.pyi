"""Inner loops in C, where a compiler was at hand. Arrays are C-contiguous and of the types given."""

import numpy as np
import numpy.typing as npt

Float32 = npt.NDArray[np.float32]

def normals(state: bytes, table: Float32, refined: int, out: Float32, /) -> bytes:
    """Fill `out` with unit normals from the table by the 16-bit words of an SFC64 generator in a state.

    Those of the `refined` cells at either end are 0. Of them the bytes tell, 64 bits each: place, word +
    refined (mod 2^16), and a further word of the generator.
    """

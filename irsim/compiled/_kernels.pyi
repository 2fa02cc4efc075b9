"""Inner loops in C, where a compiler was at hand. Arrays are C-contiguous and of the types given."""

import numpy as np
import numpy.typing as npt

def table_normals(
    words: npt.NDArray[np.uint16],
    table: npt.NDArray[np.float32],
    refined: int,
    out: npt.NDArray[np.float32],
    outer: npt.NDArray[np.int64],
    /,
) -> int:
    """out[i] = table[words[i]]; `outer` takes the places of words in the `refined` cells of either end, whose number
    is returned."""

"""Inner loops in C, where a compiler was at hand. Arrays are C-contiguous and of the types given."""

import numpy as np
import numpy.typing as npt

from irsim.types import Image

Doubles = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Table = npt.NDArray[np.uint16]

def distinct_windows(
    centers: Doubles,
    reach_x: float,
    reach_y: float,
    columns: int,
    rows: int,
    image_columns: int,
    image_rows: int,
    corners: Indices,
    places: Indices,
    /,
) -> tuple[int, int, int, int, int]:
    """Writes the corners (N, 2) of the distinct windows, row after row, and which of them each centre's is (N,).

    Gives their number, and the least (left, top) and the largest (right, bottom) of the corners. Windows wholly
    outside the image are brought to its edge.
    """

def window_masses(image: Image, table: Table, corners: Indices, kernel: Doubles, mass: Doubles, /) -> None:
    """Writes the mass (N, bins + 1) of a kernel (rows, columns) in each bin of windows with their corners (N, 2), bins
    by the table; the last bin holds what lies outside the image."""

def surround_masses(
    image: Image,
    table: Table,
    left: int,
    top: int,
    outside: int,
    first: Indices,
    kernel: Doubles,
    mass: Doubles,
    /,
) -> None:
    """Writes the mass of a kernel (rows, columns) in each bin of one window, the bins of each pixel counted from
    `first` (rows, columns); bin `outside` of them holds what lies outside the image."""

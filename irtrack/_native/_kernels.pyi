"""Kernels in C. Arrays are C-contiguous and of the types given; Floats of float64. Results are written to arguments."""

import numpy as np
import numpy.typing as npt

from irsim.types import Floats, Image

Indices = npt.NDArray[np.intp]
Table = npt.NDArray[np.uint16]
Singles = npt.NDArray[np.float32]

def distinct_windows(
    centers: Floats,
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
    """Write the corners (N, 2) of the distinct windows, row after row, and the window of each centre (N,).

    Return their number, and the least (left, top) and the largest (right, bottom) of the corners. Windows wholly
    outside the image are brought to its edge.
    """

def window_histograms(
    image: Image, table: Table, corners: Indices, kernels: Floats, mass: Floats, visible: Floats, /
) -> None:
    """Write the mass ([N,] [K,] bins + 1) of K kernels ([K,] rows, columns) in each bin of windows at corners (N, 2).

    The table gives the bins; the last bin is that of pixels outside the image. visible is empty, or has a value for
    each histogram: then these are divided by their mass inside the image, which is written there."""

def window_gradients(
    image: Image, table: Table, x: Floats, y: Floats, centers: Floats, scales: Floats, gx: Singles, gy: Singles, /
) -> int:
    """Write Sobel gradients gx, gy (N, R, C) at centers (N, 2) + scales (N, 2) * places x (C,), y (R,).

    Windows without a place in the image are left out; the number of the others is returned. Places outside have 0."""

def window_cues(
    image: Image,
    table: Table,
    x: Floats,
    y: Floats,
    centers: Floats,
    scales: Floats,
    kernel: Floats,
    edges: npt.NDArray[np.bool_],
    strength: Singles,
    angle: Singles,
    grey: Floats,
    gradient: Floats,
    visible: Floats,
    /,
) -> None:
    """Write histograms (N, bins) of the same windows, each summing to one, and the kernel's visible shares (N,).

    Grey levels are weighted by the kernel (R, C), angles by strength (n, R, C) at edges (R, C)."""

def high_pass(
    image: Image, kernel: Singles, gain: float, left: int, top: int, picture: npt.NDArray[np.uint8], /
) -> bool:
    """Write the high-passed picture (rows, columns) of a part of an image with its corner at (left, top).

    The kernel (2L+1, 2L+1) is the number of samples of each pixel. False, with nothing written, if too many."""

def bhattacharyya(p: Floats, q: Floats, rho: Floats, /) -> None:
    """Write rho (N,) of histograms p (N, bins or more) with one, q (bins,)."""

def scaled_log_weights(prior: Floats, lw: Floats, scale: float, weights: Floats, /) -> bool:
    """Write weights = scale min(lw - best, 0), all (N,), best the largest lw of a prior above 0.

    False, with nothing written, where there is none, or it is -inf."""

def normalise_product(weights: Floats, prior: Floats, /) -> None:
    """Multiply weights (N,) by prior (N,) and divide by the sum, in place."""

def sorted_uniforms(exponentials: Floats, /) -> None:
    """Replace exponentials by their running sums over the total, in place."""

def pick(weights: Floats, points: Floats, picked: Indices, /) -> None:
    """Write the smallest index whose cumulative weight exceeds each of the ascending points in [0, 1) of all weight."""

def ar2(
    positions: Floats,
    previous: Floats,
    ancestors: Indices,
    damping: float,
    deviation: Floats,
    normals: Floats,
    moved: Floats,
    origins: Floats,
    /,
) -> None:
    """Write the places (n, 2) of ancestors (n,) after damping times their last displacement and noise, and before."""

def trajectory_similarity(trajectory: Floats, places: Floats, root: bool, out: Floats, /) -> None:
    """Write the similarity (N,) of a trajectory's velocity (k, 2) and the one after each next place (N, 2).

    root: the speed is the eigenvalue's root."""

def line_fit(places: Floats, ahead: Floats, velocity: Floats, /) -> None:
    """Write the straight line through places (k, 2): its place one frame ahead, and its velocity, (2,)."""

def mean_shift(
    image: Image,
    table: Table,
    h_x: float,
    h_y: float,
    reference: Floats,
    iterations: int,
    eps: float,
    centers: Floats,
    mass: Floats,
    visible: Floats,
    /,
) -> None:
    """Move windows at centers (N, 2) until a step is shorter than eps px, or by `iterations` steps.

    Write the mass (N, bins) in each bin at their end, over the whole window's, and its visible share (N,)."""

def patch_contrast(mean: Singles, side: int, largest: Singles, /) -> None:
    """Replace largest (rows, columns) by the greater of it and the least product of differences to opposite neighbours.

    mean (rows + 2 side, columns + 2 side) of patches; where a neighbour is brighter the product counts 0."""

def local_contrast(mean: Singles, side: int, largest: Singles, peak: Singles, /) -> None:
    """Replace largest (rows, columns) by the greater of it and peak^2 over the greatest of the neighbours' means, or 1.

    mean (rows + 2 side, columns + 2 side) and peak (rows, columns): mean and largest pixel of each patch."""

def highest(heights: Singles, places: Indices, reach: int, found: npt.NDArray[np.uint8], /) -> None:
    """Write for each place (n,) of a picture (rows, columns): 0 where a pixel of the square of `reach` px is higher, 2
    where one is as high or the place is at the frame's edge, else 1."""

def merge_places(heights: Singles, places: Indices, reach: int, found: npt.NDArray[np.uint8], /) -> None:
    """Write 1 for the place nearest to the middle of each group of places (n,), which rise, else 0.

    Places are of one group where their morphological closing by the square of `reach` px is connected."""

def vertices(heights: Singles, places: Indices, centers: Floats, /) -> None:
    """Write the centres (n, 2) of parabolas along row and column through places (n,) of a picture (rows, columns)."""

def peak_sizes(
    picture: Singles, places: Indices, reach: int, edges: Singles, sizes: Floats, heights: Floats, /
) -> None:
    """Write the pixels (n, 8 reach) at the edges of squares around places (n,), the full widths (n, 2) at half maximum
    along row and column, and the heights (n,) above the median of the edge."""

def line_medians(wide: Table, reach: int, largest: Table, /) -> None:
    """Write the largest of the medians of four lines of 2 reach + 1 px through each pixel, (rows, columns).

    wide (rows + 2 reach, columns + 2 reach); reach at most 5."""

def hog_windows(
    picture: Singles, windows: Floats, bounds: Floats, columns: int, rows: int, cell: int, vectors: Floats, /
) -> None:
    """Write vectors (N, length) of oriented gradients of windows (N, 4): centre x, y and spacing x, y of the samples.

    bounds (8, 2): cosine and sine of the directions between orientations."""

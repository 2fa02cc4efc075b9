"""Inner loops in C, where a compiler was at hand. Arrays are C-contiguous and of the types given; Floats of float64."""

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
    """Writes the corners (N, 2) of the distinct windows, row after row, and which of them each centre's is (N,).

    Gives their number, and the least (left, top) and the largest (right, bottom) of the corners. Windows wholly
    outside the image are brought to its edge.
    """

def window_masses(image: Image, table: Table, corners: Indices, kernel: Floats, mass: Floats, /) -> None:
    """Writes the mass (N, bins + 1) of a kernel (rows, columns) in each bin of windows with their corners (N, 2), bins
    by the table; the last bin holds what lies outside the image."""

def surround_histograms(
    image: Image,
    table: Table,
    left: int,
    top: int,
    first: Indices,
    kernel: Floats,
    histograms: Floats,
    visible: Floats,
    /,
) -> None:
    """Counts a window and the ring around it, their corner at (left, top): the bins of each pixel begin at `first`
    (rows, columns), 0 or bins + 1.

    Writes the histograms (2, bins), each summing to one, and their visible shares (2,); zeros of what is wholly
    outside the image.
    """

def window_gradients(
    image: Image,
    table: Table,
    x: Floats,
    y: Floats,
    centers: Floats,
    scales: Floats,
    gx: Singles,
    gy: Singles,
    /,
) -> int:
    """Sobel gradients at the places x (C,), y (R,) about centers (N, 2), times scales (N, 2), of windows that have one
    in the image: how many there are, theirs coming first in gx and gy (N, R, C), zeros at places outside."""

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
    """Counts the same windows: writes histograms (N, bins) of grey levels by the kernel (R, C), of angles by strength
    (n, R, C) where edges (R, C) are, each summing to one, and the kernel's visible shares (N,), 1 if all is visible."""

def high_pass(
    image: Image, kernel: Singles, gain: float, left: int, top: int, picture: npt.NDArray[np.uint8], /
) -> bool:
    """Writes the high-passed picture (rows, columns) of a part of an image with its corner at (left, top), by a kernel
    (2L+1, 2L+1) that says how often each pixel counts. False, with nothing written, where it has too many samples."""

def bhattacharyya(p: Floats, q: Floats, rho: Floats, /) -> None:
    """Writes rho (N,) of histograms p (N, bins or more) to one, q (bins,)."""

def below_best(prior: Floats, score: Floats, factor: float, out: Floats, /) -> bool:
    """out = factor min(score - best, 0), all (N,), the best being that of a prior above 0; False, with nothing
    written, where there is none, or it is -inf."""

def weighted(weights: Floats, prior: Floats, /) -> None:
    """Weights (N,) times prior (N,), over their sum, in place."""

def sorted_uniforms(exponentials: Floats, /) -> None:
    """Running sums over their total, in place."""

def pick(weights: Floats, points: Floats, picked: Indices, /) -> None:
    """For ascending points in [0, 1): the smallest index whose cumulative weight exceeds the point's share of all."""

def ar2_drawn(
    positions: Floats,
    previous: Floats,
    chosen: Indices,
    damping: float,
    deviation: Floats,
    normals: Floats,
    moved: Floats,
    origins: Floats,
    /,
) -> None:
    """Where particles `chosen` (n,) of (N, 2) move by damping times their last displacement and noise, and were."""

def velocity_likeness(trajectory: Floats, places: Floats, root: bool, out: Floats, /) -> None:
    """Likeness (N,) of the velocity that each of the places (N, 2) would give the trajectory (k, 2) to the one it has;
    `root`: the speed is the eigenvalue's root."""

def line(places: Floats, ahead: Floats, velocity: Floats, /) -> None:
    """The straight line through places (k, 2): where it is one frame on, and its velocity, (2,)."""

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
    """Moves windows at centers (N, 2) until a step is shorter than eps px, or by so many iterations; writes the mass
    (N, bins) in each bin where they rest, over the whole window's, and its visible share (N,)."""

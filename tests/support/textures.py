"""Random ground for tests of registration."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats


def texture(seed: int, rows: int = 140, columns: int = 180) -> Floats:
    """Smooth random ground of deviation 25 about 100 counts."""
    rough = np.random.default_rng(seed).standard_normal((rows, columns))
    smooth = np.asarray(cv2.GaussianBlur(rough, (0, 0), 3), np.float64)
    return 100 + 25 * smooth / float(smooth.std())


def counts(picture: Floats) -> npt.NDArray[np.uint8]:
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)

"""Folders of pictures to import."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np


def pictures(count: int = 4, dtype: type = np.uint8, size: tuple[int, int] = (32, 24)) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.integers(0, np.iinfo(dtype).max + 1, size[::-1]).astype(dtype) for _ in range(count)]


def folder_of(path: Path, images: list[np.ndarray]) -> Path:
    path.mkdir()
    for index, image in enumerate(images):
        assert cv2.imwrite(str(path / f"frame_{index}.png"), image)
    return path

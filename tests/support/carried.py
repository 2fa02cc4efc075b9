"""Scenes whose camera is carried, and how far apart two pictures of one thing are."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from irsim.backgrounds import Layer
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import Floats

Mask = npt.NDArray[np.bool_]


def scene(background: dict[str, Any], velocity_m_s: tuple[float, float, float], **changes: Any) -> Scenario:
    """61 frames, two seconds, of 0.5 mrad a pixel and no noise; the middle of the picture falls on a pixel."""
    platform = {"kind": "platform", "velocity_m_s": velocity_m_s}
    camera = {
        "size": (161, 121),
        "psf_px": 0.6,
        "netd_mk": 0,
        "motion": [platform],
        "elevation_deg": 10.0,
        **changes.pop("camera", {}),
    }
    return Scenario.model_validate({"frames": 61, "camera": camera, "background": background, **changes})


def layer_of(renderer: Renderer, name: str) -> Layer:
    return next(layer for layer in renderer.layers if layer.name == name)


def passed(renderer: Renderer, name: str, frame: int) -> Floats:
    """(rows, cols): the transmittance of a layer."""
    found = layer_of(renderer, name).light(renderer.now(frame).view_direction(frame))[0]
    assert found is not None
    return found


def apart(one: Floats, other: Floats, where: slice | Mask = slice(None)) -> tuple[float, float]:
    """(dx, dy) px by which what `other` shows has to be moved to lie where `one` shows it, to first order."""
    down, right = (np.asarray(slope) for slope in np.gradient(other.astype(np.float64)))
    slopes = np.stack([right[where].ravel(), down[where].ravel()], axis=1)
    off = np.asarray(other - one)[where].astype(np.float64)
    dx, dy = np.linalg.lstsq(slopes, off.ravel(), rcond=None)[0].tolist()
    return dx, dy


def resampled(picture: Floats, columns: Floats, rows: Floats) -> Floats:
    """(rows, cols): a picture at places between its pixels, by cubics."""
    x, y = (np.asarray(at, np.float32) for at in (columns, rows))
    return np.asarray(cv2.remap(picture, x, y, cv2.INTER_CUBIC), np.float32)


CLOUDS = {"coverage": 0.5, "correlation_mrad": 30.0, "depth": 1.0, "beta": 4.5}

"""Periodic textures: filtering, the lens's blur, sampling by a chart, and reuse from frame to frame.

Texels are means over the area of a pixel, so blurring applies the transfer function of the lens only, without the
pixel's. A picture that does not repeat is blurred by OpenCV's filter if the PSF is Gaussian, else by convolution with a
kernel, which is ten times as slow for a narrow PSF and no slower for a wide one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import cv2
import numpy as np

from irsim.backgrounds.base import ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.physics.psf import PSF, GaussianPSF
from irsim.types import Floats

TILE = 1024
"""Period of a texture, px."""

ROOM = 64
"""Extent, px, to which textures are repeated beyond a frame's size, as key frames are larger than frames."""

SQUARE = 2048
"""Largest side, px, up to which a texture is square for any frame."""

BLOCK = 8
"""Number of consecutive frames that share a key frame; a worker of `--jobs` renders whole blocks."""

MARGIN = 16
"""Margin of a key frame, px, which is also the largest shift of the frames that share it."""

BENT = 0.05
"""Largest deviation from a pure shift, px, with which a frame is drawn as its key frame, shifted. Backgrounds are no
ground truth, and a twentieth of a pixel at the corner is invisible; sampling every pixel (four arrays a frame with two
cloud layers, 1 ms each at 640x512) costs ten times a shift."""

FINE_SIGMA_PX = 2.5
"""Least sigma of a blur computed at reduced size, px of the reduced picture. The rms error of cubic interpolation is
then 2 % for slopes of clouds (beta 3.3); a sigma of 5 px would give 1 %, in nine times the time."""

SMALLEST_SIDE = 16
"""Least side of a reduced picture, px."""

CUBIC_REACH = 2
"""Half width of cubic interpolation, px."""

Move = tuple[float, float]
"""Displacement (right, down), px."""


def closed(texture: Floats) -> Floats:
    """Return a periodic texture with its first row and column repeated past its last."""
    return np.asarray(cv2.copyMakeBorder(texture, 0, 1, 0, 1, cv2.BORDER_WRAP))


def window(texture: Floats, rows: slice, columns: slice) -> Floats:
    """Return a part of a periodic texture (rows, columns) or (rows, columns, channels), also past its edges."""
    down, across = (list(_pieces(*part)) for part in zip((rows, columns), texture.shape[:2], strict=True))
    strips = [[texture[piece, beside] for beside in across] for piece in down]
    if len(down) == len(across) == 1:
        return strips[0][0]
    return np.concatenate([np.concatenate(strip, axis=1) for strip in strips])


def _pieces(part: slice, period: int) -> Iterator[slice]:
    """Yield the slices of one period that make up `part`, which may reach past the period's ends."""
    begin = part.start
    while begin < part.stop:
        first = begin % period
        last = min(first + part.stop - begin, period)
        yield slice(first, last)
        begin += last - first


def coarseness(sigma_px: float, side: int) -> int:
    """Return the power of two by which a picture of `side` px may be reduced in size before a blur of `sigma_px`."""
    return 1 << max(int(np.log2(min(sigma_px / FINE_SIGMA_PX, side / SMALLEST_SIDE))), 0)


def shrunk(texture: Floats, coarse: int) -> Floats:
    """Return a texture reduced by `coarse`: means of blocks of coarse x coarse pixels, float32."""
    rows, columns = (length // coarse for length in texture.shape[:2])
    return np.asarray(cv2.resize(texture, (columns, rows), interpolation=cv2.INTER_AREA))


def enlarged(texture: Floats, coarse: int, rows: slice, columns: slice) -> Floats:
    """Return a part, also past the edges, of a periodic float32 texture enlarged by cubic interpolation."""
    if coarse == 1:
        return window(texture, rows, columns)
    reach = CUBIC_REACH
    down, across = (slice(part.start // coarse - reach, -(-part.stop // coarse) + reach) for part in (rows, columns))
    large = cv2.resize(window(texture, down, across), None, fx=coarse, fy=coarse, interpolation=cv2.INTER_CUBIC)
    top, left = rows.start - down.start * coarse, columns.start - across.start * coarse
    return np.asarray(large[top : top + rows.stop - rows.start, left : left + columns.stop - columns.start])


def periodic_gaussian(texture: Floats, sigma_px: float) -> Floats:
    """Return a periodic texture (rows, columns), float32, after a Gaussian blur."""
    texture = np.asarray(texture, dtype=np.float32)
    margin = _gaussian_margin_px(sigma_px, min(texture.shape))
    wide = np.asarray(cv2.copyMakeBorder(texture, margin, margin, margin, margin, cv2.BORDER_WRAP), dtype=np.float32)
    return _inner_gaussian(wide, sigma_px, margin)


def _gaussian_margin_px(sigma_px: float, side: int) -> int:
    return min(int(np.ceil(5 * sigma_px)), side)


def _inner_gaussian(wide: Floats, sigma_px: float, margin: int) -> Floats:
    """Return the Gaussian blur of a picture, float32, without its margin."""
    if margin == 0:
        return wide
    soft = cv2.GaussianBlur(wide, (2 * margin + 1, 2 * margin + 1), sigma_px)
    return np.asarray(soft[margin:-margin, margin:-margin])


def blurred_periodic(texture: Floats, psf: PSF, texels: int = 1) -> Floats:
    """Return a periodic texture (rows, columns), as float32, blurred by a lens whose pixels are `texels` wide."""
    otf = _otf(psf, texture.shape[0], texture.shape[1], texels)
    if np.ptp(texture) == 0:  # uniform, to the last bit: halves the time for flat ground
        return np.full(texture.shape, np.float64(texture[0, 0]) * otf[0, 0], np.float32)
    return np.fft.irfft2(np.fft.rfft2(texture) * otf, s=texture.shape).astype(np.float32)


@lru_cache(maxsize=1)
def _otf(psf: PSF, rows: int, columns: int, texels: int) -> Floats:
    """Return the OTF at the frequencies of `rfft2`, cached for consecutive textures of one shape."""
    return psf.otf(texels * np.fft.fftfreq(rows)[:, None], texels * np.fft.rfftfreq(columns)[None, :])


def blurred(picture: Floats, psf: PSF) -> Floats:
    """Return a picture (rows, columns) of floats blurred by a lens; its edge pixels extend outwards."""
    if not isinstance(psf, GaussianPSF):
        return np.asarray(cv2.filter2D(picture, -1, _kernel(psf), borderType=cv2.BORDER_REPLICATE))
    if psf.sigma_px == 0:
        return picture
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), psf.sigma_px, borderType=cv2.BORDER_REPLICATE))


def blur_margin_px(psf: PSF, side: int) -> int:
    """Return the margin that the blur of a picture (side, side) needs, px."""
    return _gaussian_margin_px(psf.sigma_px, side) if isinstance(psf, GaussianPSF) else min(psf.support_px, side)


def blurred_inner(wide: Floats, psf: PSF, margin: int) -> Floats:
    """Return a picture, float32, blurred by a lens, without its margin."""
    if isinstance(psf, GaussianPSF):
        return _inner_gaussian(wide, psf.sigma_px, margin)
    return blurred(wide, psf)[margin:-margin, margin:-margin]


@lru_cache(maxsize=4)
def _kernel(psf: PSF) -> Floats:
    """Return the kernel, (n, n) float32, n = 2 support + 1, with the lens's OTF at the n frequencies of either axis.

    Light beyond the support is wrapped around into it, as for targets.
    """
    side = 2 * psf.support_px + 1
    otf = psf.otf(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    return np.fft.fftshift(np.fft.irfft2(otf, s=(side, side))).astype(np.float32)


@dataclass(frozen=True, eq=False)
class PeriodicTexture:
    """Periodic texture on the map of directions, repeated past its edges so that a frame need not wrap around, unless
    the frame is much longer than wide and the camera rolled."""

    shape: tuple[int, int]
    """Periods, px, down and across."""
    padded: Floats
    phase: tuple[float, float]
    """Texel coordinates (column, row) of the map's origin, chosen so that the pixels of a camera at rest fall on texels
    and need no interpolation."""

    @classmethod
    def of(cls, texture: Floats, frame: tuple[int, int], psf: PSF) -> PeriodicTexture:
        """Return a texture (rows, columns), blurred by the lens, for frames of (columns, rows)."""
        columns, rows = frame
        (high, wide), most = texture.shape, repeated_px(frame)
        margins = (most, most) if high == wide else (rows + ROOM, columns + ROOM)
        phase = (columns - 1) / 2 % 1, (rows - 1) / 2 % 1  # (0, 0) is the frame's centre
        soft = np.pad(blurred_periodic(texture, psf), [(0, margin) for margin in margins], mode="wrap")
        return cls((high, wide), soft, phase)

    def places(self, chart: Chart, shift_px: Move) -> tuple[Floats, Floats]:
        """Return the texture's column and row at each pixel, (rows, cols) float32 each."""
        u, v = chart.u - shift_px[0] + self.phase[0], chart.v - shift_px[1] + self.phase[1]
        # Whole periods are removed before float32, whose steps grow with distance. The frame's edge lies slightly
        # past the outermost nodes and may still be left of 0.
        u, v = (at - np.floor(at.min() / period) * period for at, period in zip((u, v), self.shape[::-1], strict=True))
        columns, rows = (
            np.mod(places, period) if places.min() < 0 or places.max() > length - 1 else places
            for places, period, length in zip(
                (chart.at_pixels(u), chart.at_pixels(v)), self.shape[::-1], self.padded.shape[::-1], strict=True
            )
        )
        return columns, rows

    def at(self, columns: Floats, rows: Floats) -> Floats:
        """Return the texture at positions between its texels, by linear interpolation."""
        return np.asarray(cv2.remap(self.padded, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))


def repeated_px(frame: tuple[int, int]) -> int:
    """Return the extent, px, to which a texture is repeated past its edges, so that a frame (columns, rows) need not
    wrap around."""
    return int(np.hypot(*frame)) + ROOM


def tile_side(frame: tuple[int, int]) -> int:
    """Return the side of a texture for frames of (columns, rows): at least TILE, and at least a frame's."""
    return max(TILE, 1 << (max(frame) - 1).bit_length())


def tile_shape(frame: tuple[int, int]) -> tuple[int, int]:
    """Return rows and columns of a texture that need not be square: along the short side of a long frame it has only
    TILE."""
    side = tile_side(frame)
    columns, rows = (side if length > TILE or side <= SQUARE else TILE for length in frame)
    return rows, columns


class TextureSampler(Protocol):
    """Set of textures that can be sampled for a frame."""

    def sample(self, view_direction: ViewDirection) -> list[Floats]:
        """Return the textures of one frame, each (rows, cols) float32. Read only."""
        ...


class DriftingTextures:
    """Textures with one position on the map, which drift together.

    The key frame's pictures are cached, and the last shifted pictures while nothing moves. A frame does not depend on
    the frames sampled before.
    """

    def __init__(self, tiles: tuple[PeriodicTexture, ...], drift_px_s: Move = (0.0, 0.0)) -> None:
        self.tiles = tiles
        self.drift_px_s = drift_px_s
        self._key_pictures: tuple[Floats, list[Floats]] | None = None
        self._last: tuple[list[Floats], Move, list[Floats]] | None = None

    def sample(self, view_direction: ViewDirection) -> list[Floats]:
        """Return the textures of one frame, each (rows, cols) float32. Read only."""
        move = None if view_direction.key is None else self.move(view_direction, view_direction.key)
        if view_direction.key is None or move is None:
            return self._look_up(view_direction)
        key = view_direction.key.chart.uv - self._drift(view_direction.key)[:, None, None]
        kept = self._key_pictures  # read once: another thread may replace it
        if kept is None or not np.array_equal(key, kept[0]):
            kept = self._key_pictures = key, self._look_up(view_direction.key)
        last = self._last
        if last is None or last[0] is not kept[1] or last[1] != move:
            last = self._last = kept[1], move, _shifted(kept[1], view_direction.chart.geometry.size, move)
        return last[2]

    def _drift(self, view_direction: ViewDirection) -> Floats:
        """Return the drift, (2,) px, right and down."""
        return np.array(self.drift_px_s) * view_direction.time

    def _look_up(self, view_direction: ViewDirection) -> list[Floats]:
        right, down = self._drift(view_direction).tolist()
        columns, rows = self.tiles[0].places(view_direction.chart, (right, down))
        return [tile.at(columns, rows) for tile in self.tiles]

    def move(self, view_direction: ViewDirection, key: ViewDirection) -> Move | None:
        """Return the shift of the key frame's picture that gives this frame; None if a shift is not accurate enough."""
        right, down = (self._drift(key) - self._drift(view_direction)).tolist()
        return _move_to(view_direction.chart, key.chart, (right, down))


@lru_cache(maxsize=32)
def _move_to(chart: Chart, key: Chart, drift: Move) -> Move | None:
    """Return the shift for `DriftingTextures.move` from two charts, cached for cameras and textures at rest."""
    wanted = chart.uv + np.array(drift)[:, None, None]
    move = np.zeros(2)
    for _ in range(3):  # Newton: the map's slope is one within a few percent
        move = move + (wanted - key.shifted(move)).mean(axis=(1, 2))
        if np.abs(move).max() > MARGIN - 1:
            return None
    bent = np.abs(wanted - key.shifted(move)).max()
    right, down = move.tolist()
    return (right, down) if bent <= BENT else None


def _shifted(pictures: Sequence[Floats], size: tuple[int, int], move: Move) -> list[Floats]:
    """Return the pictures of a frame, cut out of wider ones displaced by `move`; read only."""
    middle = tuple(MARGIN + (length - 1) / 2 + by for length, by in zip(size, move, strict=True))
    shifted: list[Floats] = [np.asarray(cv2.getRectSubPix(wide, size, middle)) for wide in pictures]
    for each in shifted:
        each.flags.writeable = False
    return shifted

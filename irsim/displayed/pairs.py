"""Counts and the pictures that a camera showed of them, frame by frame, and what they say together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from irsim.camera.agc import Picture
from irsim.measure import FRAMES, ROUNDING
from irsim.types import Floats, Image, Source

SCORED = 12
"""Frames whose pictures are compared, spread over the recording: their differences tell a standard error."""
LEAD = 0.25
"""Share of the frames at the beginning that only feed the memory of an AGC: a camera that ran before the recording
began remembers frames that are not in it."""
INVERTED = -0.8
"""Correlation of ranks below which a picture is black-hot: of the kinds here, inverted, it is -1 to -0.91, through JPEG
of quality 50, too (the scene of tests/test_displayed.py)."""
LEVELS = 2048
"""Steps of the counts between which a free curve may rise: an eighth of a grey each, where all greys are used."""

PLACE = 16
"""Side of places whose mean greys are compared, px; of pictures of less than two of them a half of their side."""
PATCH = 8
"""Side of patches in which a curve that changes over the picture is one line, px."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Frames of counts in order, and the pictures of some of them.

    counts      (T, rows, columns) unsigned, `bits` deep
    pictures    frame -> (rows, columns) uint8, as it was shown
    ran         whether the display had seen the first frame all along, and did not begin with it
    """

    counts: npt.NDArray[Any]
    bits: int
    pictures: dict[int, Picture]
    ran: bool = False

    @property
    def scored(self) -> tuple[int, ...]:
        return tuple(sorted(self.pictures))


def scored_frames(count: int, lead: int = 0) -> tuple[int, ...]:
    """Which of so many frames are compared, of which the first `lead` are not."""
    first = max(int(LEAD * count), lead)
    return tuple(sorted({int(k) for k in np.linspace(first, count - 1, SCORED)}))


def paired(stack: npt.NDArray[Any], bits: int, pictures: Source, start: int = 0, lead: int = 0) -> Pairs:
    """Frames (T, rows, columns) from frame `start` on, and what a source has as pictures of some of them.

    lead    how many frames, the first, only feed the memory of an AGC, at least
    """
    frames = stack[-FRAMES:]
    cut = len(stack) - len(frames)
    shown = {k: pictures.frame(start + cut + k).image for k in scored_frames(len(frames), lead - cut)}
    return Pairs(frames, bits, {k: image.astype(np.uint8) for k, image in shown.items()})


@dataclass(frozen=True, eq=False)
class Tally:
    """What a frame's pictures have at each count: enough to know the error of any single curve.

    present     (1, P) counts that there are
    pixels      (P,) how many pixels have each
    greys       (P,) their mean grey
    within      squared greys by which pixels of one count differ, summed
    """

    present: Image
    pixels: Floats
    greys: Floats
    within: float

    @classmethod
    def of(cls, counts: Image, picture: Picture) -> Tally:
        flat = counts.ravel()
        pixels = np.bincount(flat)
        sums = np.bincount(flat, weights=picture.ravel())
        present = np.flatnonzero(pixels)
        many, greys = pixels[present].astype(np.float64), sums[present] / pixels[present]
        square = float((picture.astype(np.float64) ** 2).sum())
        within = max(square - float((many * greys**2).sum()), 0.0)
        return cls(present[np.newaxis].astype(np.uint16), many, greys, within)

    def error(self, shown: Picture) -> float:
        """Mean squared error, greys, of a curve that shows the present counts so, (1, P)."""
        apart = float((self.pixels * (shown[0] - self.greys) ** 2).sum())
        return (apart + self.within) / float(self.pixels.sum())


def scatter(counts: Image, picture: Picture) -> float:
    """Variance of grey among pixels of one count, or nearly: what no single curve of the frame explains."""
    apart, free = _apart(counts, picture)
    return float((apart * apart).sum()) / max(free, 1)


def parted(counts: Image, picture: Picture) -> float:
    """Share of that variance that is between places: as where each has a curve of its own."""
    apart, _ = _apart(counts, picture)
    place = max(min(PLACE, min(apart.shape) // 2), 1)
    rows, columns = (side // place * place for side in apart.shape)
    means = apart[:rows, :columns].reshape(rows // place, place, -1, place).mean(axis=(1, 3))
    return float((means * means).mean()) / max(float((apart * apart).mean()), ROUNDING)


def _apart(counts: Image, picture: Picture) -> tuple[Floats, int]:
    """Each grey less the mean of pixels whose count is the same, or nearly; and how many of these are free."""
    flat = counts.ravel().astype(np.float64)
    low, high = np.percentile(flat[:: max(flat.size // 20_000, 1)], (0.1, 99.9))
    steps = np.clip((flat - low) * (LEVELS / max(high - low, LEVELS / 4)), -1, LEVELS).astype(np.int64) + 1
    pixels = np.bincount(steps)
    sums = np.bincount(steps, weights=picture.ravel())
    apart = picture - (sums / np.maximum(pixels, 1))[steps].reshape(picture.shape)
    return apart, flat.size - int(np.count_nonzero(pixels))


def patched(counts: Image, picture: Picture) -> float:
    """Variance of grey about a parabola on the counts in each patch: what no curve that changes slowly over the picture
    explains."""
    x, left = (_patches(image) for image in (counts, picture))
    x = x / np.maximum(np.abs(x).max(axis=1, keepdims=True), 1e-9)
    for each in (x, _without(_centred(x * x), x)):
        left = _without(left, each)
    return float((left * left).sum(axis=1).mean()) / (PATCH * PATCH - 3)


def _patches(image: Image) -> Floats:
    """(P, PATCH x PATCH) patches less their means."""
    rows, columns = (side // PATCH * PATCH for side in image.shape)
    parts = image[:rows, :columns].astype(np.float64).reshape(rows // PATCH, PATCH, -1, PATCH).swapaxes(1, 2)
    return _centred(parts.reshape(-1, PATCH * PATCH))


def _centred(values: Floats) -> Floats:
    centred: Floats = values - values.mean(axis=1, keepdims=True)
    return centred


def _without(values: Floats, of: Floats) -> Floats:
    """Each row less what it has of another."""
    shares = (values * of).sum(axis=1, keepdims=True) / np.maximum((of * of).sum(axis=1, keepdims=True), 1e-12)
    left: Floats = values - shares * of
    return left


def silent(pairs: Pairs) -> str | None:
    """Why the pictures say nothing of the display, where they do not."""
    shown = list(pairs.pictures.values())
    if all(picture.min() == picture.max() for picture in shown):
        return "every picture has one grey throughout"
    if all(frame.min() == frame.max() for frame in _scored(pairs)):
        return "every frame has one count throughout"
    if len(shown) > 1 and _still(shown) and not _still(list(_scored(pairs))):
        return "the pictures stand still while the counts change"
    if all(_falls(pairs.counts[k], pairs.pictures[k]) for k in pairs.scored):
        return "the pictures are inverted, black-hot: no kind of AGC known here"
    return None


def _falls(counts: Image, picture: Picture) -> bool:
    """Whether the mean greys of counts fall where these rise, by ranks (Spearman)."""
    from scipy.stats import spearmanr

    tally = Tally.of(counts, picture)
    if tally.greys.min() == tally.greys.max():
        return False
    return bool(spearmanr(tally.present[0], tally.greys).statistic < INVERTED)


def _scored(pairs: Pairs) -> Iterator[Image]:
    return (pairs.counts[k] for k in pairs.scored)


def _still(frames: Sequence[Image]) -> bool:
    return all(np.array_equal(frames[0], frame) for frame in frames[1:])

"""Rows and columns with offsets of their own, told from the texture of a scene by where they lie in its spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.measure.hann import HANN_FREEDOM, HANN_GAIN
from irsim.measure.interval import LEVEL, Measured, chi_square, jackknife, root
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

_FINEST = 0.1
"""Cycles a px from which lines are looked for: below, a scene's horizon and slopes speak."""
_FAINT = 1e-3
"""Least variance of lines that is tried, as a share of the least power that is expected without them; and none."""
_TRIED = 1000
_KINK = 4
"""The power of a kink, a horizon below which a sky no longer changes, falls as f to this power."""
_BENDS = 4.0
"""Gain of log likelihood from which there is a kink beside lines: of a real cooled camera, whose rows differ most from
its sixth to its eighth, it is 3.1, of 240 skies of white noise and lines 2.1 at most, of 40 with a horizon in the
middle 15 to 29, near an end 1 to 7."""
_STEPS = 40
_BLOCKS = 8
_PARTS = 6
_BENT = 35 / 18
"""By how much fewer lines are independent that are compared with their neighbours: 1 + 2 (4/6)^2 + 2 (1/6)^2."""
_OUTSTANDING = 3.2
"""Robust sigmas beyond which a line may be the scene's: of 120 Gaussian ones one in six pictures has one."""
_DOUBTFUL = (2.6, 4.5)
"""Which lines are the scene's is not known: the interval holds what is told when those beyond the less of these are
left out, and when only those beyond the greater are. Rows of 0.08 times the noise then lay below it in 1.5 % of 400
pictures with a horizon below which a sky ends, above in 3.3 %, and before nothing in 2 and 1.5 %; without that in 4 and
6 %, and 5 and 3 %, in intervals three quarters as wide."""
_SURELY = 6.0
"""And beyond which it is, of many. Of n, whose sigma is not known well, 1 + 8 / n times as much is asked for: of a
thousand pictures of noise, 8 px a side and more, hardly one has such a line."""


@dataclass(frozen=True)
class Lines:
    """Sigmas of offsets from row to row and from column to column, in the units of the picture."""

    row: Measured
    column: Measured


def lines(periodogram: Floats, density: Floats, shape: tuple[int, int]) -> Lines:
    """Lines of a picture (rows, columns) by its periodogram beside the `density` of all else.

    Offsets of rows are all in the frequencies with fx = 0, where they have columns x 2/3 times their
    variance under a Hann window.
    """
    rows, columns = shape
    y, x = _fine(shape)
    return Lines(
        _excess(periodogram[y, 0], density[y, 0], np.fft.fftfreq(rows)[y], columns * HANN_GAIN),
        _excess(periodogram[0, x], density[0, x], np.fft.rfftfreq(columns)[x], rows * HANN_GAIN),
    )


def kinked(periodogram: Floats, density: Floats, shape: tuple[int, int]) -> tuple[str, ...]:
    """Along what a picture as `lines` takes it has more than lines, which are white: "rows", as a sky that begins at a
    horizon, "columns"."""
    rows, columns = shape
    y, x = _fine(shape)
    axes = (
        ("rows", periodogram[y, 0], density[y, 0], np.fft.fftfreq(rows)[y]),
        ("columns", periodogram[0, x], density[0, x], np.fft.rfftfreq(columns)[x]),
    )
    return tuple(name for name, *axis in axes if _bends(*axis))


def _fine(shape: tuple[int, int]) -> tuple[Bools, Bools]:
    """The frequencies of rows and of columns, in the order of numpy's rfft2, at which lines are looked for."""
    down, across = np.fft.fftfreq(shape[0]), np.fft.rfftfreq(shape[1])
    return (down > _FINEST) & (down < 0.49), (across > _FINEST) & (across < 0.49)


def _bends(power: Floats, expected: Floats, frequency: Floats) -> bool:
    """Whether powers at n frequencies are likelier those of white lines and a kink than of white lines alone."""
    losses = _losses(power, expected, frequency, _added(power, expected, _STEPS)).min(axis=1)
    return bool(losses[0] - losses.min() > _BENDS)


def _excess(power: Floats, expected: Floats, frequency: Floats, gain: float) -> Measured:
    """Sigma of lines from powers at n frequencies beside those expected without them.

    All frequencies count alike in it. Its interval holds that by Whittle's likelihood too, in which they count by how
    little is expected: how much a texture has on the very axis is not known well where it is strong. And in that,
    whatever part of them is a kink's.
    """
    mean = _above(float(power.mean()), float(expected.mean()), gain, 2 * power.size / HANN_FREEDOM)
    added = _added(power, expected, _TRIED)
    losses = _losses(power, expected, frequency, added)
    likely = np.concatenate([_likely(added, losses[0]), _likely(added, losses.min(axis=0))]) / gain
    return Measured(mean.value, min(mean.low, root(float(likely.min()))), max(mean.high, root(float(likely.max()))))


def _added(power: Floats, expected: Floats, count: int) -> Floats:
    """Powers, from none to more than there is, that are tried beside what is expected."""
    least = float(expected.min()) * _FAINT
    return np.concatenate([[0.0], np.geomspace(least, max(10 * float(power.max()), 2 * least), count)])


def _losses(power: Floats, expected: Floats, frequency: Floats, added: Floats) -> Floats:
    """(kinks, added) by how much log likelihood falls short at n frequencies, with none of a kink's power first."""
    falling = (frequency / frequency[0]) ** -_KINK
    losses = []
    for kink in _added(power, expected, _STEPS):
        density = expected + kink * falling + added[:, None]
        losses.append((np.log(density) + power / density).sum(axis=1) / HANN_FREEDOM)
    return np.stack(losses)


def _likely(added: Floats, loss: Floats) -> Floats:
    """Variances, least to greatest, that all frequencies may have above what is expected, by a ratio of likelihoods."""
    from scipy.stats import chi2

    return np.asarray(added[loss <= loss.min() + chi2.ppf(LEVEL, 1) / 2])


def _above(power: float, usual: float, gain: float, freedom: float) -> Measured:
    """Sigma of what adds its variance, times `gain`, to a `usual` power; the sum is a chi-square of so much freedom.

    Where the sum is less than is usual, by more than chance, the usual is not known: all of it may be what is added.
    """
    whole = chi_square(power, freedom)
    if whole.high <= usual:
        return Measured(0.0, 0.0, root(whole.high / gain))
    return whole.map(lambda variance: root((variance - usual) / gain))


def common_lines(picture: Floats) -> Lines:
    """Lines of a picture (rows, columns; 3 or more of each) in which things are seen: what all parts have in common.

    Each row less the mean of its neighbours has 3/2 of the variance of rows' offsets. The median over a sixth of the
    columns passes edges by, and the product of two such parts that do not touch holds, in the mean, the offsets alone.
    A row that stands out in the whole picture is a horizon or a road, and left out with those beside it, over which
    optics blur it.
    """
    return Lines(_common(picture), _common(picture.T))


def crossed(picture: Floats) -> tuple[str, ...]:
    """Along what edges of a scene go all across a picture (rows, columns; 3 or more of each): "rows", as a horizon,
    "columns", as a pole or a house higher than the picture."""
    axes = (("rows", 1), ("columns", 0))
    return tuple(name for name, axis in axes if _surely_out(_bent(picture.mean(axis=axis))).any())


def _bent(levels: Floats) -> Floats:
    """Each row of (rows, ...) but the outermost less the mean of its neighbours."""
    return np.asarray(levels[1:-1] - (levels[:-2] + levels[2:]) / 2)


def _standing_out(levels: Floats, sigmas: float) -> Bools:
    apart = np.abs(levels - np.median(levels))
    far: Bools = apart > sigmas * MEDIAN_TO_SIGMA * np.median(apart)
    return far


def _surely_out(levels: Floats) -> Bools:
    return _standing_out(levels, _SURELY * (1 + 8 / levels.size))


def _common(picture: Floats) -> Measured:
    """Sigma of a picture's rows."""
    bent = _bent(picture)
    parts = np.stack([np.median(part, axis=1) for part in np.array_split(bent, min(_PARTS, bent.shape[1]), axis=1)])
    found = _shared(parts, _OUTSTANDING)
    fewer, more = (_shared(parts, sigmas) for sigmas in _DOUBTFUL)
    return Measured(found.value, min(fewer.low, found.low), max(found.high, more.high))


def _shared(parts: Floats, sigmas: float) -> Measured:
    """Sigma of rows by the bent levels (parts, rows) of each part of a picture, without those that stand out."""
    out = _standing_out(parts.mean(axis=0), sigmas)
    beside = out.copy()
    beside[1:] |= out[:-1]
    beside[:-1] |= out[1:]
    kept = parts[:, ~(out if beside.all() else beside)]
    common = np.mean([one @ other for k, one in enumerate(kept) for other in kept[k + 2 :]]) / kept.shape[1]
    power = float(np.square(kept.mean(axis=0)).mean())
    return _above(power, power - float(common), 1.5, kept.shape[1] / _BENT)


def turns(picture: Floats, axis: int) -> Measured:
    """By how much even rows (axis 0) or columns (1) of a picture lie above odd ones, halved; below 0 where below.

    Each is compared with the mean of its two neighbours, but beside edges that go all across. The interval is that of a
    jackknife over 8 blocks, which holds what a scene adds, or that by how all pairs scatter, whichever is wider: blocks
    may happen to be alike (of 3,000 pictures of lines, one had ends 9 times as close as another; together 4).
    """
    bent = _bent(picture.mean(axis=1 - axis))
    above = bent / 2 * np.where(np.arange(1, len(bent) + 1) % 2, -1, 1)
    above = above[: len(above) // 2 * 2].reshape(-1, 2)
    across = _surely_out(above).any(axis=1)
    pairs = above.mean(axis=1) if (~across).sum() < 2 else above[~across].mean(axis=1)
    blocks = np.array([block.mean() for block in np.array_split(pairs, min(_BLOCKS, len(pairs)))])
    found = jackknife(blocks[:, None], lambda mean: mean)[0]
    reach = max(found.high - found.value, _reach(pairs))
    return Measured(found.value, found.value - reach, found.value + reach)


def _reach(pairs: Floats) -> float:
    """How far the mean of (N,) values, of which neighbours have a line in common, may be off: Student's t."""
    from scipy.stats import t

    count, off = len(pairs), pairs - pairs.mean()
    variance = float(off @ off + 2 * off[1:] @ off[:-1]) / (count - 1)
    return float(t.ppf((1 + LEVEL) / 2, count - 1)) * root(variance / count)


def without_turns(picture: Floats, rows: float, columns: float) -> Floats:
    """The picture less what even and odd rows and columns differ by (halves, as `turns` gives them)."""
    signs = [np.where(np.arange(length) % 2, -1.0, 1.0) for length in picture.shape]
    evened: Floats = picture - rows * signs[0][:, None] - columns * signs[1]
    return evened

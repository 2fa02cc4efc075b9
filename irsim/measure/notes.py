"""What a recording does not tell of its camera, and what was taken for it, in sentences.

What limits more comes first: notes on the recording, on its noise, on texture and pattern, on the blur, and then on
what is written.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from irsim.errors import counted
from irsim.measure.field import Spectrum
from irsim.measure.interval import Measured
from irsim.measure.left_out import left_out_notes
from irsim.measure.noise import NoiseReport
from irsim.measure.pattern import Pattern
from irsim.measure.steady import TOLD_SIDE
from irsim.measure.still import Still
from irsim.measure.words import report_notes
from irsim.types import Floats

AT_MOST = (
    "the noise is at most what is told of it, but for noise that remembers or that neighbours share, which is not in "
    "it: texture that moves and is as sharp as noise is counted with it"
)
SMALL = (
    f"in a picture of less than {TOLD_SIDE} px a side a scene that slides cannot be told from noise that the camera "
    "smooths: it is taken for such a scene"
)


def noise_notes(report: NoiseReport) -> Iterator[str]:
    if report.moving and not report.slides:
        yield (
            f"something moves at {report.region}, where noise is read: of the noise only what is sharp is told, no "
            "memory, rows, columns or level; region=X,Y,W,H names a place that is still"
        )
        yield AT_MOST
    elif report.together and not report.moving:
        yield (
            f"neighbouring pixels change together at {report.region}, where noise is read: the camera smooths its "
            "noise, or something moves fast; region=X,Y,W,H names a place that is still"
        )
    yield from report_notes(report)


def outstanding(things: Sequence[int]) -> Iterator[str]:
    """Of so many small things that stand far out of each of some pictures."""
    if most := max(things):
        what = "small thing stands" if most == 1 else "small things stand"
        yield f"{most} {what} far out of the texture: left out of its spectrum, mean and histogram"


def texture_notes(fixed: Pattern, picture: Floats, noise: float) -> Iterator[str]:
    yield from left_out_notes(fixed, picture, noise)
    if fixed.quietest is not None:
        yield (
            f"edges and things of the scene look like fixed pattern: it is told at {fixed.quietest}, where least is "
            "seen, rows and columns by what all parts of the picture have in common"
        )
    elif fixed.across:
        along = " and ".join(fixed.across)
        yield f"edges of the scene go all across the picture, along {along}: fixed {along} are told beside them"


_LAYERED = 0.5
"""Share of a picture's variance that the means of its rows have, above which it is layered: of 24 grounds, whose
largest features are as wide as the picture, one has 0.4 and the others less; with a horizon it is 0.6 to 0.9."""
_USUAL = (0.02, 0.98)
"""Shares of the pixels between which a picture's usual values lie: hot things do not make rows differ."""


def unlike_notes(spectrum: Spectrum, picture: Floats, moves: bool) -> Iterator[str]:
    """What a ground of the same texture all over does not make again of a picture (rows, columns)."""
    if spectrum.texture is None:
        return
    usual = np.clip(picture, *np.quantile(picture, _USUAL))
    if usual.mean(axis=1).var() > _LAYERED * usual.var():
        yield (
            "the picture is layered, as with a horizon: sky, sea, waves and rows of things are not made again, the "
            "background is written as a ground of one texture all over"
        )
    if moves:
        yield "what moves in the scene is written standing still"


def blur_notes(blur: Measured | None, psf: Measured, still: Still) -> Iterator[str]:
    if blur is None:
        yield f"no point is seen: the blur is taken to be {psf.value:.1g} px"
        yield f"texture and fixed pattern are told for any blur of {psf.low:.1g} to {psf.high:.1g} px"
    else:
        yield (
            f"the sharpest thing seen is blurred by {blur.value:.2g} px, its own size among it: the lens may be "
            f"sharper, and texture and fixed pattern are told for any blur of {psf.low:.2g} to {psf.high:.2g} px"
        )
        if psf.value != blur.value:
            yield f"the blur is taken to be {psf.value:.2g} px, under which the texture is clearly likelier"
    if still.points:
        yield f"points that stand still: {len(still.points)}; they are no texture, fixed pattern or hot pixels"
    if full := int(still.full.sum()):
        yield (
            f"{counted(full, 'pixel')} {'is' if full == 1 else 'are'} full of light all the time: what is there and "
            "beside it is left out of texture, fixed pattern and bad pixels"
        )

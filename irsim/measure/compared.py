"""A source's texture and noise beside those of real recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from irsim.errors import InputError, expect_source
from irsim.measure.backdrop import TEXTURE_PICTURES, backdrops
from irsim.measure.boxes import boxes_of_targets
from irsim.measure.counts import Progress, read_timed
from irsim.measure.depth import perhaps_pictures
from irsim.measure.figures import Figures, measure_figures
from irsim.measure.interval import Measured
from irsim.measure.realism import Judged, Verdict, check_class, judge_classes
from irsim.measure.realism_noise import check_sort, judge_sorts, noise_figures
from irsim.measure.spectrum import texture
from irsim.types import Source

_NOISY = 120
"""Frames whose noise is compared with real cameras'."""


@dataclass(frozen=True)
class Realism:
    """Texture and noise beside real ones.

    texture, classes    what is measured, and beside classes of backgrounds; empty and None where it is not asked for
    noise, sorts        the same of noise, beside all sorts of camera; empty and None where it cannot be judged
    noise_unknown       why it cannot, in a line; None where it can
    """

    texture: Mapping[str, float]
    classes: Judged | None
    noise: Mapping[str, Measured]
    sorts: Judged | None
    noise_unknown: str | None

    @property
    def judged(self) -> tuple[Judged, ...]:
        return tuple(each for each in (self.classes, self.sorts) if each is not None)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each figure beside the range of the class and the sort that are asked for."""
        return tuple(verdict for each in self.judged for verdict in each.verdicts)

    @property
    def inside(self) -> bool:
        """Whether no figure is outside what is asked for."""
        return all(verdict.inside for verdict in self.verdicts)

    def lines(self) -> Iterator[str]:
        """For people: all but why noise is unknown."""
        if self.classes is not None:
            yield from self.classes.lines("looks like", "no class of real recordings")
        if self.sorts is not None:
            yield from self.sorts.lines("its noise is like", "that of no real camera")

    def as_json(self) -> dict[str, Any]:
        """Plain values, ready for json.dumps."""
        told: dict[str, Any] = {}
        if self.classes is not None:
            told = {**self.texture, "like": self.classes.asked, "classes": self.classes.fitting}
        if self.sorts is None:
            told["noise_unknown"] = self.noise_unknown
        else:
            noise = {figure: measured.as_json() for figure, measured in self.noise.items()}
            told |= {"camera": self.sorts.asked, **noise, "cameras": self.sorts.fitting}
        kept = {name: verdicts for each in self.judged for name, verdicts in each.apart.items()}
        outside = {name: [verdict.figure for verdict in verdicts] for name, verdicts in kept.items()}
        ranges = {v.figure: {"low": v.low, "high": v.high, "inside": v.inside} for v in self.verdicts}
        return {**told, "outside": outside, "ranges": ranges}


def measure_realism(
    source: Source, like: str | None = None, camera: str | None = None, progress: Progress | None = None
) -> Realism:
    """Compare a source's texture, and its noise, with real recordings.

    like        class of backgrounds, one of `CLASSES`, to judge the texture by; none where not given
    camera      sort of camera, one of `CAMERAS`, to judge the noise by; where it is given, texture is measured only
                if `like` is, too
    progress    told of the frames that are read for the noise

    InputError where there is no such class or sort, pictures are too small to have a texture, or `camera` is given and
    the noise cannot be judged.
    """
    expect_source("a comparison", source)
    if like is not None:
        check_class(like)
    if camera is not None:
        check_sort(camera)
    found: dict[str, float] = {}
    classes = None
    if camera is None or like is not None:
        measured = texture(backdrops(source, TEXTURE_PICTURES))
        found, classes = asdict(measured), judge_classes(measured, like)
    figures = _noisy_figures(source, camera is not None, progress)
    if isinstance(figures, str):
        if camera is not None:
            raise InputError(figures)
        return Realism(found, classes, {}, None, figures)
    return Realism(found, classes, noise_figures(figures), judge_sorts(figures, camera), None)


def _noisy_figures(source: Source, asked: bool, progress: Progress | None) -> Figures | str:
    """Figures whose noise can be compared with real cameras', or in a line why there are none."""
    if perhaps_pictures(source) and not asked:
        return "its noise is not judged, for pictures of 8 bits hold no sensor's; allowed: a sensor's counts"
    looked = range(min(_NOISY, len(source)))
    stack, times = read_timed(source, looked, progress)
    boxes = boxes_of_targets(source, looked.start, looked.stop)
    top = 2.0**source.bits - 1
    try:
        found = measure_figures(stack, source.rate_hz, None, top, passing=asked, times=times, boxes=boxes)
        noise_figures(found)
    except InputError as error:
        return str(error)
    return found

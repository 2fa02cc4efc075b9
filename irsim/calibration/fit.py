"""Fit of a camera and a background to a recording, written as a scenario."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from irsim.calibration.figures import FRAMES, Figures, measure_figures
from irsim.calibration.report import fit_summary, interval, number
from irsim.calibration.selection import (
    EIGHT_BITS,
    Region,
    TimedFrames,
    may_be_pictures,
    read_frames,
    target_boxes,
)
from irsim.calibration.statistics import Estimate
from irsim.camera.agc import Agc
from irsim.camera.bad_pixels import MAX_BAD
from irsim.camera.drift import Drift
from irsim.camera.sensor import NETD_K, ElectronSensor, SensorSettings, matched_sensor
from irsim.config.base import dump
from irsim.errors import InputError, counted
from irsim.physics.radiometry import Scale, radiance, slope, temperature
from irsim.recording.writer import default_agc
from irsim.render.sources import open_source
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.types import Band, Curve, Source

NOMINAL_RANGE_K = (220.0, 400.0)
NOMINAL_IFOV_RAD = 0.5e-3
"""Nominal pixel, and scale above, of a camera that the recording does not describe; counts do not depend on them."""
_BY = "by irsim fit;"
"""Part of the first line of a fit."""
_SEAL = "# A later fit replaces this file as long as nothing is changed in it: "
"""Beginning of the last line of a fit, before the digest of the text above it."""


@dataclass(frozen=True)
class Fit:
    """Camera and background of a recording.

    figures     in counts, px and frames, with intervals
    text        a scenario as YAML, with intervals as comments; its last line has the digest by which a later
                `irsim fit -o` recognises an unchanged fit
    notes       limits, those of the figures first
    """

    name: str
    figures: Figures
    text: str
    notes: tuple[str, ...]

    @cached_property
    def scenario(self) -> Scenario:
        return loads(self.text, f"fit of {self.name}")

    def summary(self) -> Iterator[tuple[str, str]]:
        """Yield labels and texts of the figures."""
        return fit_summary(self.figures)

    def as_json(self) -> dict[str, Any]:
        """Return plain values, ready for json.dumps."""
        found, flaws = self.figures, self.figures.flaws
        estimates = dict(found.estimates())
        plain = {"flaws.cluster": flaws.cluster if flaws.any else None, "flaws.dead_level": flaws.dead_level}
        return {
            "source": self.name,
            "frames": found.frames,
            "region": list(found.region),
            "mean": found.mean,
            "histogram": list(found.histogram),
            "figures": {name: value.as_json() for name, value in estimates.items()}
            | {name: [value, None, None] for name, value in plain.items() if value is not None},
            "bounds": [name for name, value in estimates.items() if value.bound],
            "notes": list(self.notes),
        }


def fit(
    source: str | PathLike[str] | Scenario | Source,
    region: Region | None = None,
    start: int = 0,
    stop: int | None = None,
) -> Fit:
    """Return the fit to a recording, or to the rendering of a scenario.

    region      window with noise alone, px; by default the flattest still window off the targets
    start, stop frames that are measured; by default the first 300

    Raise InputError where frames are too few or too small, or a source cannot be opened.
    """
    opened = open_source(source)
    last = min(start + FRAMES, len(opened)) if stop is None else min(stop, len(opened))
    return fit_frames(read_frames(opened, range(start, last)), opened, region, start)


def fit_frames(read: TimedFrames, source: Source, region: Region | None = None, start: int = 0) -> Fit:
    """Return the fit to frames read from a source, from frame `start` on."""
    counts, times = read
    figures = measure_figures(
        counts,
        source.rate_hz,
        region,
        2.0**source.bits - 1,
        start=start,
        times=times,
        boxes=target_boxes(source, start, start + len(counts)),
    )
    writer = Writer.of(source, figures)
    text = "\n".join(writer.lines(len(counts))) + "\n"
    return Fit(source.name, figures, sealed(text), (*writer.notes, *_refusals(text)))


def _refusals(text: str) -> Iterator[str]:
    """Yield the errors of a fit outside the limits of scenarios, such as a small picture or strong noise."""
    try:
        loads(text, "the fit")
    except InputError as error:
        yield from (f"irsim render refuses this: {line}" for line in str(error).splitlines())


def sealed(text: str) -> str:
    """Return a fit's text with a last line that holds its digest, in place of an older one."""
    before, seal, rest = text.rpartition(_SEAL)
    body = before if seal else rest
    return f"{body}{_SEAL}{hashlib.blake2b(body.encode(), digest_size=16).hexdigest()}\n"


def check_replaced(path: Path | None) -> None:
    """Raise InputError where the file exists and is not an unchanged fit: a fit would replace the user's work."""
    if path is None or not path.exists():
        return
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    if _SEAL in text and text == sealed(text):
        return
    if _BY not in text.partition("\n")[0]:
        reason = "exists and is no fit"
    else:
        reason = "was changed after irsim fit wrote it" if _SEAL in text else "the last line of a fit is missing"
    raise InputError(f"{path}: {reason}, and a fit would replace it; allowed: another name")


@dataclass(frozen=True)
class Writer:
    """Writer of figures as keys of a scenario."""

    name: str
    size: tuple[int, int]
    rate_hz: float
    bits: int
    ifov_rad: float
    band: Band
    range_k: tuple[float, float]
    curve: Curve | None
    agc: Agc
    agc_reason: str
    figures: Figures
    notes: tuple[str, ...]

    @classmethod
    def of(cls, source: Source, figures: Figures) -> Writer:
        facts = source.camera
        agc, reason, agc_notes = _agc(source)
        known = (
            ("its field of view", facts.ifov_rad),
            ("its band", facts.band),
            ("its scale", facts.range_k or facts.curve),
        )
        unknown = [words for words, fact in known if fact is None]
        nominal = []
        if unknown:
            nominal.append(f"the recording does not say {' and '.join(unknown)}: nominal values; counts are right")
        first = [EIGHT_BITS] if may_be_pictures(source) else []
        return cls(
            name=source.name,
            size=source.size,
            rate_hz=source.rate_hz,
            bits=max(source.bits, 8),
            ifov_rad=facts.ifov_rad or NOMINAL_IFOV_RAD,
            band=facts.band or "lwir",
            range_k=facts.range_k or NOMINAL_RANGE_K,
            curve=facts.curve,
            agc=agc,
            agc_reason=reason,
            figures=figures,
            notes=(*first, *figures.notes, *nominal, *agc_notes),
        )

    @cached_property
    def scale(self) -> Scale:
        return Scale.known(self.curve, self.band, self.range_k, self.bits)

    def per_kelvin(self, kelvin: float) -> float:
        """Return the counts per kelvin of a black body."""
        return self.scale.slope(float(radiance(self.band, kelvin))) * slope(self.band, kelvin)

    @cached_property
    def electrons(self) -> ElectronSensor | None:
        """Detector with the recording's response to light; None where two black bodies give the scale."""
        if self.curve is None:
            return None
        return matched_sensor(self.curve, self.band, self.bits, self.rate_hz, _at_least(self.figures.noise.value))

    @cached_property
    def unit(self) -> float:
        """Counts of a noise ratio of 1."""
        if self.electrons is None:
            return _at_least(self.figures.noise.value)
        response = self.electrons.response(SensorSettings(self.band, self.bits, 0.0, self.range_k))
        return response.noise / response.gain

    def lines(self, frames: int) -> Iterator[str]:
        """Yield the lines of a scenario of that many frames."""
        columns, rows = self.size
        found = self.figures
        yield f"# Fitted to {counted(found.frames, 'frame')} of {self.name} {_BY} ranges are 95 % intervals."
        yield from (f"# Note: {note}." for note in self.notes)
        yield f"about: {json.dumps(f'A camera and a background like those of {self.name}')}"
        yield f"frames: {frames}"
        yield "camera:"
        yield f"  size: [{columns}, {rows}]"
        yield f"  rate_hz: {self.rate_hz:.6g}"
        yield f"  ifov_mrad: {self.ifov_rad * 1e3:.6g}"
        yield f"  band: {self.band if isinstance(self.band, str) else list(self.band)}"
        yield f"  bits: {self.bits}"
        yield _line("  psf_px", found.psf)
        yield from self.detector()
        yield "  noise:"
        for kind, values in self.noises():
            yield f"    - kind: {kind}"
            for key, value in values.items():
                yield _line(f"      {key}", value) if isinstance(value, Estimate) else f"      {key}: {value}"
        yield f"  agc: {json.dumps(dump(self.agc))}  # {self.agc_reason}"
        yield from self.background()

    def detector(self) -> Iterator[str]:
        """Yield the scale of the counts and the NETD."""
        per_kelvin = self.per_kelvin(NETD_K)
        netd = _line("netd_mk", self.figures.noise.map(lambda counts: _at_least(counts) / per_kelvin * 1000))
        if self.electrons is None:
            yield f"  range_k: [{self.range_k[0]:.6g}, {self.range_k[1]:.6g}]"
            yield f"  {netd}"
            return
        yield "  detector:  # same counts for the same light; the number of electrons is not known"
        for key in ("kind", "pitch_um", "integration_ms", "read_noise_e", "well_me", "offset"):
            value = getattr(self.electrons, key)
            yield f"    {key}: {value if isinstance(value, str) else number(value, 9)}"
        yield f"  # {netd}"

    def noises(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield kinds of noise with their keys."""
        found = self.figures
        terms = {
            "tvh": found.white,
            "tv": found.row_noise,
            "th": found.column_noise,
            "t": found.level if found.level_frames is None else None,
            "vh": found.pixel,
            "v": found.row,
            "h": found.column,
        }
        yield "noise_3d", {"tvh": 0, **{key: self.ratio(value) for key, value in terms.items() if value is not None}}
        if found.memory is not None and found.memory_frames is not None and found.memory.value:
            yield "ar1", {"ratio": self.ratio(found.memory), "time_constant_s": self.seconds(found.memory_frames)}
        for over, lines in (("row", found.rows), ("column", found.columns)):
            if lines is not None and lines.correlated.value:
                ratio = self.ratio(lines.correlated)
                yield "ar1", {"id": f"{over}s", "over": over, "ratio": ratio, "time_constant_s": lines.time_constant_s}
        drifts = {
            "pixel": None if found.walk is None else found.walk.map(lambda counts: counts * math.sqrt(self.rate_hz)),
            "column": None if found.columns is None else found.columns.drift,
            "row": None if found.rows is None else found.rows.drift,
        }
        if any(drifts.values()):
            slow = Drift().time_constant_s  # the recording does not determine the final size of a slower drift
            scale = math.sqrt(slow / 2)
            ends = {
                key: 0 if walk is None else self.ratio(walk.map(lambda counts: counts * scale))
                for key, walk in drifts.items()
            }
            yield "drift", {**ends, "time_constant_s": slow}
        if found.level is not None and found.level_frames is not None:
            time = self.seconds(found.level_frames)
            yield "ar1", {"id": "level", "over": "frame", "ratio": self.ratio(found.level), "time_constant_s": time}
        for along, offset in found.odd_even:
            yield "odd_even", {"id": f"odd_even_{along}", "along": along, "ratio": self.ratio(offset)}
        if found.flaws.any:
            yield "bad_pixels", dict(self.bad_pixels())

    def bad_pixels(self) -> Iterator[tuple[str, Any]]:
        bad, full = self.figures.flaws, 2**self.bits - 1
        for kind, share in bad.shares.items():
            yield kind, replace(share, value=min(share.value, MAX_BAD))
        yield "cluster", f"{bad.cluster:.3g}"
        if bad.dead_level is not None:
            yield "dead_level", f"{min(max(bad.dead_level / full, 0), 1):.4g}"
        for key, height in (("hot_ratio", bad.hot_height), ("blink_ratio", bad.jump)):
            if height is not None:
                yield key, self.ratio(height)
        for key, dwell in (("on_s", bad.on_frames), ("off_s", bad.off_frames)):
            if dwell is not None:
                yield key, self.seconds(dwell)

    def background(self) -> Iterator[str]:
        """Yield a ground of the same spectrum, spread and histogram: texture without objects."""
        found = self.figures
        mean_k = self.kelvin(found.mean)
        yield "background:"
        yield "  kind: ground"
        yield f"  mean_k: {mean_k:.5g}"
        if found.texture is None:
            yield "  spread_k: 0  # no texture like that of ground stands out from the noise"
            return
        texture, per_kelvin, px = found.texture, self.per_kelvin(mean_k), self.ifov_rad * 1e3
        yield _line("  spread_k", texture.spread.map(lambda counts: counts / per_kelvin))
        yield f"  betas: [{texture.beta_x.value:.3g}, {texture.beta_y.value:.3g}]  # along x {interval(texture.beta_x)}"
        yield f"  # along y {interval(texture.beta_y)}"
        yield _line("  correlation_mrad", texture.correlation_px.map(lambda length: length * px))
        yield _line("  stretch", texture.stretch)
        if found.histogram:
            yield f"  histogram: [{', '.join(f'{self.kelvin(value):.6g}' for value in found.histogram)}]"

    def kelvin(self, counts: float) -> float:
        return float(temperature(self.band, self.scale.light(np.array(counts))))

    def ratio(self, counts: Estimate) -> Estimate:
        return counts.map(lambda value: min(value / self.unit, 1000.0))

    def seconds(self, frames: Estimate) -> Estimate:
        return frames.map(lambda value: value / self.rate_hz)


def _agc(source: Source) -> tuple[Agc, str, tuple[str, ...]]:
    """Return the AGC of a scenario, the reason for it, and notes: counts do not determine an AGC."""
    usual, agc = default_agc(source.bits), source.agc
    if isinstance(agc, Agc) and (source.scenario_text is not None or agc != usual):
        return agc, "as the recording says", ()
    if source.bits <= 8:
        return usual, "the counts are the picture", ("8 bits: the counts are shown as they are",)
    return usual, "the default", ("counts do not determine the AGC: the default is written",)


def _at_least(counts: float) -> float:
    """Return noise in counts, at least 0.01: a NETD of 0 would leave noise ratios no unit."""
    return max(counts, 0.01)


def _line(key: str, value: Estimate) -> str:
    return f"{key}: {number(value.value)}  # {interval(value)}"

"""Writer of the figures of a camera and a background as a scenario in YAML, with intervals as comments."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from irsim.calibration.figures import Figures
from irsim.calibration.report import interval, number
from irsim.calibration.selection import EIGHT_BITS, may_be_pictures
from irsim.calibration.statistics import Estimate
from irsim.camera.agc import Agc
from irsim.camera.bad_pixels import MAX_BAD
from irsim.camera.drift import Drift
from irsim.camera.sensor import NETD_K, ElectronSensor, SensorSettings, matched_sensor
from irsim.config.base import dump
from irsim.errors import counted
from irsim.physics.radiometry import Scale, radiance, slope, temperature
from irsim.recording.writer import default_agc
from irsim.types import Band, Source

NOMINAL_BAND: Band = "lwir"
NOMINAL_RANGE_K = (220.0, 400.0)
NOMINAL_IFOV_RAD = 0.5e-3
"""Band, temperatures of count 0 and full scale, and angle of a pixel, for a camera that the recording does not
describe. The counts of the scenario do not depend on them."""
BY = "by irsim fit;"
"""Words in the first line of each fitted scenario."""


@dataclass(frozen=True)
class ScenarioWriter:
    """Writer of a source's figures as a scenario."""

    source: Source
    figures: Figures

    @cached_property
    def band(self) -> Band:
        return self.source.camera.band or NOMINAL_BAND

    @cached_property
    def range_k(self) -> tuple[float, float]:
        return self.source.camera.range_k or NOMINAL_RANGE_K

    @cached_property
    def ifov_rad(self) -> float:
        return self.source.camera.ifov_rad or NOMINAL_IFOV_RAD

    @cached_property
    def bits(self) -> int:
        return max(self.source.bits, 8)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the limits of the scenario."""
        facts = self.source.camera
        scale = facts.range_k or facts.curve
        known = (("its field of view", facts.ifov_rad), ("its band", facts.band), ("its scale", scale))
        unknown = " and ".join(words for words, fact in known if fact is None)
        nominal = f"the recording does not say {unknown}: nominal values; counts are right"
        first = (EIGHT_BITS,) if may_be_pictures(self.source) else ()
        return (*first, *self.figures.notes, *((nominal,) if unknown else ()), *self.agc[2])

    @cached_property
    def agc(self) -> tuple[Agc, str, tuple[str, ...]]:
        """AGC of the scenario, the reason for it, and notes, as counts do not determine an AGC."""
        source = self.source
        usual, agc = default_agc(source.bits), source.agc
        if isinstance(agc, Agc) and (source.scenario_text is not None or agc != usual):
            return agc, "as the recording says", ()
        if source.bits <= 8:
            return usual, "the counts are the picture", ("8 bits: the counts are shown as they are",)
        return usual, "the default", ("counts do not determine the AGC: the default is written",)

    @cached_property
    def scale(self) -> Scale:
        return Scale.known(self.source.camera.curve, self.band, self.range_k, self.bits)

    def per_kelvin(self, kelvin: float) -> float:
        """Return the change of counts per kelvin of a black body's temperature."""
        return self.scale.slope(float(radiance(self.band, kelvin))) * slope(self.band, kelvin)

    @cached_property
    def electrons(self) -> ElectronSensor | None:
        """Sensor with the response of the recording; None where the temperatures of two counts give the scale."""
        curve = self.source.camera.curve
        if curve is None:
            return None
        return matched_sensor(curve, self.band, self.bits, self.source.rate_hz, _at_least(self.figures.noise.value))

    @cached_property
    def unit(self) -> float:
        """Counts that correspond to a noise ratio of 1."""
        if self.electrons is None:
            return _at_least(self.figures.noise.value)
        response = self.electrons.response(SensorSettings(self.band, self.bits, 0.0, self.range_k))
        return response.noise / response.gain

    def lines(self, frames: int) -> Iterator[str]:
        """Yield the lines of a scenario with `frames` frames."""
        columns, rows = self.source.size
        found, (agc, reason, _) = self.figures, self.agc
        yield f"# Fitted to {counted(found.frames, 'frame')} of {self.source.name} {BY} ranges are 95 % intervals."
        yield from (f"# Note: {note}." for note in self.notes)
        yield f"about: {json.dumps(f'A camera and a background like those of {self.source.name}')}"
        yield f"frames: {frames}"
        yield "camera:"
        yield f"  size: [{columns}, {rows}]"
        yield f"  rate_hz: {self.source.rate_hz:.6g}"
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
        yield f"  agc: {json.dumps(dump(agc))}  # {reason}"
        yield from self.background()

    def detector(self) -> Iterator[str]:
        """Yield the lines with the scale of the counts and the NETD."""
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
        """Yield each kind of noise with its keys and values."""
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
            "pixel": None
            if found.walk is None
            else found.walk.map(lambda counts: counts * math.sqrt(self.source.rate_hz)),
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
        """Yield the keys and values of noise of kind bad_pixels."""
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
        """Yield the lines of a ground with the fitted spectrum, spread and histogram, without objects."""
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
        return frames.map(lambda value: value / self.source.rate_hz)


def _at_least(counts: float) -> float:
    """Return noise in counts, at least 0.01. With a NETD of 0, noise ratios would have no unit."""
    return max(counts, 0.01)


def _line(key: str, value: Estimate) -> str:
    return f"{key}: {number(value.value)}  # {interval(value)}"

"""What was measured in a recording, in the words of a scenario."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from irsim.camera.detectors import MOST_BAD, NETD_K, Drift, Electrons, Setting, electrons_like
from irsim.fitting.agc import ChosenAgc
from irsim.fitting.numbers import interval, plain
from irsim.fitting.written import BY
from irsim.measure import EIGHT_BITS, Figures, Measured, perhaps_pictures
from irsim.physics.radiometry import radiance, slope, temperature
from irsim.physics.scale import Scale
from irsim.types import Band, Curve, Source
from irsim.wording import counted

NOMINAL_RANGE_K = (220.0, 400.0)
NOMINAL_IFOV_RAD = 0.5e-3
"""What a camera is taken to be where the recording does not say: counts are right all the same."""


@dataclass(frozen=True)
class Scene:
    """Counts, px and frames in the words of a scenario; `notes` on the recording, the figures and what is written."""

    name: str
    size: tuple[int, int]
    rate_hz: float
    bits: int
    ifov_rad: float
    band: Band
    range_k: tuple[float, float]
    curve: Curve | None
    agc: ChosenAgc
    figures: Figures
    notes: tuple[str, ...]

    @classmethod
    def of(cls, source: Source, figures: Figures) -> Scene:
        facts = source.camera
        agc = ChosenAgc.of(source)
        unknown = [
            word
            for word, known in (
                ("its field of view", facts.ifov_rad),
                ("its band", facts.band),
                ("its scale", facts.range_k or facts.curve),
            )
            if known is None
        ]
        nominal = []
        if unknown:
            nominal.append(f"the recording does not say {' and '.join(unknown)}: nominal values; counts are right")
        # What limits all figures comes first.
        limits = [EIGHT_BITS] if perhaps_pictures(source) else []
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
            figures=figures,
            notes=(*limits, *figures.notes, *nominal, *agc.notes),
        )

    @cached_property
    def scale(self) -> Scale:
        """What its counts stand for."""
        return Scale.known(self.curve, self.band, self.range_k, self.bits)

    @property
    def full(self) -> int:
        return int(2**self.bits - 1)

    def per_kelvin(self, kelvin: float) -> float:
        """Counts per kelvin of a black body of that temperature."""
        return self.scale.slope(float(radiance(self.band, kelvin))) * slope(self.band, kelvin)

    @cached_property
    def electrons(self) -> Electrons | None:
        """A detector whose counts stand for the same light; None where two black bodies tell what they stand for."""
        if self.curve is None:
            return None
        return electrons_like(self.curve, self.band, self.bits, self.rate_hz, _least(self.figures.noise.value))

    @cached_property
    def sigma(self) -> float:
        """What noise ratios are in units of, counts: one without noise still has some, for its fixed pattern."""
        if self.electrons is None:
            return _least(self.figures.noise.value)
        response = self.electrons.response(Setting(self.band, self.bits, 0.0, self.range_k))
        return response.noise / response.gain

    def lines(self, frames: int) -> Iterator[str]:
        """Of a scenario of so many frames."""
        columns, rows = self.size
        found = self.figures
        yield f"# Fitted to {counted(found.frames, 'frame')} of {self.name} {BY} ranges are 95 % intervals."
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
                yield _line(f"      {key}", value) if isinstance(value, Measured) else f"      {key}: {value}"
        yield from (f"  {line}" for line in self.agc.lines())
        yield from self.background()

    def detector(self) -> Iterator[str]:
        """What counts stand for, and the NETD: as keys, or beside a detector that has it of itself."""
        per_kelvin = self.per_kelvin(NETD_K)
        netd = _line("netd_mk", self.figures.noise.map(lambda counts: _least(counts) / per_kelvin * 1000))
        if self.electrons is None:
            yield f"  range_k: [{self.range_k[0]:.6g}, {self.range_k[1]:.6g}]"
            yield f"  {netd}"
            return
        yield "  detector:  # it gives the counts of the recording; how many electrons there were is not known"
        for key in ("kind", "pitch_um", "integration_ms", "read_noise_e", "well_me", "offset"):
            value = getattr(self.electrons, key)
            yield f"    {key}: {value if isinstance(value, str) else plain(value, 9)}"
        yield f"  # {netd}"

    def noises(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Kinds of noise with their keys."""
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
        yield "noise_3d", {"tvh": 0, **{key: self._ratio(value) for key, value in terms.items() if value is not None}}
        if found.memory is not None and found.memory_frames is not None and found.memory.value:
            yield self._lasting("pixel", found.memory, self._seconds(found.memory_frames), found.memory_age_s)
        for over, lines in (("row", found.rows), ("column", found.columns)):
            if lines is not None and lines.correlated.value:
                yield self._lasting(over, lines.correlated, lines.time_constant_s, lines.age_s)
        drifts = {
            "pixel": None if found.walk is None else found.walk.map(lambda counts: counts * math.sqrt(self.rate_hz)),
            "column": None if found.columns is None else found.columns.told_walk,
            "row": None if found.rows is None else found.rows.told_walk,
        }
        if any(drifts.values()):
            slow = Drift().time_constant_s  # How far it goes at last nobody saw: it slows down after that.
            ends = {key: 0 if walk is None else self._drift(walk, slow) for key, walk in drifts.items()}
            yield "drift", {**ends, "time_constant_s": slow}
        if found.level is not None and found.level_frames is not None:
            time = self._seconds(found.level_frames)
            yield "ar1", {"id": "level", "over": "frame", "ratio": self._ratio(found.level), "time_constant_s": time}
        for along, turned in found.turned:
            yield "odd_even", {"id": f"odd_even_{along}", "along": along, "ratio": self._ratio(turned)}
        if found.flawed:
            yield "bad_pixels", dict(self._flaws())

    def _lasting(self, over: str, sigma: Measured, time_s: Measured, age_s: float) -> tuple[str, dict[str, Any]]:
        """Noise with memory: always there, or since a correction, as what drifts is."""
        named = {} if over == "pixel" else {"id": f"{over}s", "over": over}
        if math.isinf(age_s):
            return "ar1", {**named, "ratio": self._ratio(sigma), "time_constant_s": time_s}
        none = {each: 0 for each in ("pixel", "column", "row") if each != over}
        since = {"time_constant_s": time_s, "age_s": plain(age_s)}
        return "drift", {"id": f"{over}s", over: self._ratio(sigma), **none, **since}

    def _drift(self, walk: Measured, slow_s: float) -> Measured:
        """What a drift tends to, of that time constant, which begins with so many counts a root of a second."""
        return self._ratio(walk.map(lambda counts: counts * math.sqrt(slow_s / 2)))

    def _flaws(self) -> Iterator[tuple[str, Any]]:
        bad = self.figures.flaws
        for kind, share in bad.shares.items():
            yield kind, replace(share, value=min(share.value, MOST_BAD))
        yield "cluster", f"{bad.cluster:.3g}"
        if bad.dead_level is not None:
            yield "dead_level", f"{min(max(bad.dead_level / self.full, 0), 1):.4g}"
        for key, height in (("hot_ratio", bad.hot_height), ("blink_ratio", bad.jump)):
            if height is not None:
                yield key, self._ratio(height)
        for key, stay in (("on_s", bad.on_frames), ("off_s", bad.off_frames)):
            if stay is not None:
                yield key, self._seconds(stay)

    def background(self) -> Iterator[str]:
        """A ground of the same spectrum, spread and histogram: texture, not the things that were seen."""
        found = self.figures
        mean_k = self._kelvin(found.mean)
        yield "background:"
        yield "  kind: ground"
        yield f"  mean_k: {mean_k:.5g}"
        if found.texture is None:
            yield "  spread_k: 0  # no texture like a ground's stands out from the noise"
            return
        texture = found.texture
        per_kelvin = self.per_kelvin(mean_k)
        px = self.ifov_rad * 1e3
        yield _line("  spread_k", texture.spread.map(lambda counts: counts / per_kelvin))
        yield f"  betas: [{texture.beta_x.value:.3g}, {texture.beta_y.value:.3g}]  # along x {interval(texture.beta_x)}"
        yield f"  # along y {interval(texture.beta_y)}"
        yield _line("  correlation_mrad", texture.correlation_px.map(lambda length: length * px))
        yield _line("  stretch", texture.stretch)
        if found.histogram:
            yield f"  histogram: [{', '.join(f'{self._kelvin(value):.6g}' for value in found.histogram)}]"

    def _kelvin(self, counts: float) -> float:
        return float(temperature(self.band, self.scale.light(np.array(counts))))

    def _ratio(self, counts: Measured) -> Measured:
        return counts.map(lambda value: min(value / self.sigma, 1000.0))

    def _seconds(self, frames: Measured) -> Measured:
        return frames.map(lambda value: value / self.rate_hz)


def _least(counts: float) -> float:
    """Noise of so many counts, or of so few that nobody sees them: a NETD of 0 would leave noise terms no unit."""
    return max(counts, 0.01)


def _line(key: str, value: Measured) -> str:
    return f"{key}: {plain(value.value)}  # {interval(value)}"

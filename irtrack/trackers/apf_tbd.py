"""`apf_tbd`: track before detect, an auxiliary particle filter on the pixels of a whitened frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, exp, log, sqrt
from typing import Annotated, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.detectors.peaks import Picture, robust_scale
from irtrack.features.centroid import contrast
from irtrack.features.window import region
from irtrack.filters.particle import Likelihood, Weights, equal_weights, mean, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Indices, Resampling, multinomial
from irtrack.trackers.base import (
    Footage,
    MonitoredTracker,
    Ratio,
    Spread,
    VisibilityMonitor,
    footage,
    start_window,
)
from irtrack.types import Estimate

COARSE = 2.0
"""Standard deviation of the target's image on its narrower axis, px, above which pixels are averaged in blocks, so that
a large target costs no more than a small one."""
LEAST_PSF = 0.6
"""Least standard deviation of the target's image, px."""
LEAST_SNR = 3.0
"""Least signal-to-noise ratio of the target's image in the first frame; a fainter one is taken as this bright."""
FAINTEST_SNR = 1.5
"""Least signal-to-noise ratio of a particle; a fainter target is indistinguishable from noise."""
START_EXISTENCE = 0.95
"""Probability that the start box holds a target."""
GROWTH = 1.0
"""Growth of the birth density's standard deviation in each frame without the target, px."""
UNKNOWN = 3.0
"""Standard deviation of the logarithm of a new target's amplitude, in steps of the amplitude's random walk."""
NEVER = 1e-300
"""Least probability of which a logarithm is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Settings taken from the first frame.

    size   (w, h) px of the box;  sign  1 hot, -1 cold;  block  side of the averaged blocks of pixels, px
    psf    (x, y) standard deviation of the target's image h, blocks;  x, y  offsets of its samples (C,), (R,), blocks
    gain   factor of the whitened frame, 1 or less (see `snr_limit`)
    """

    footage: Footage
    size: tuple[float, float]
    sign: float
    block: int
    psf: tuple[float, float]
    x: Floats
    y: Floats
    gain: float = 1.0

    @property
    def energy(self) -> float:
        """Sum of h^2 over the samples."""
        return float((self.line(0) ** 2).sum() * (self.line(1) ** 2).sum())

    def line(self, axis: int) -> Floats:
        """Return h along one axis at a target on the middle of a block."""
        line: Floats = np.exp(-((self.x, self.y)[axis] ** 2) / (2 * self.psf[axis] ** 2))
        return line


@dataclass(frozen=True, slots=True, eq=False)
class APFTBDState:
    """State: particles (K, 5), x, y px, vx, vy px/frame, amplitude A; weights (K,), given that the target exists.

    existence  P(E | z_1..k);  track (4,)  last estimate where the target existed, moved on by its velocity
    level      mean amplitude there, standard deviations of the noise
    """

    start: Start
    particles: Floats
    weights: Floats
    existence: float
    track: Floats
    level: float
    monitor: VisibilityMonitor


class APFTBD(MonitoredTracker):
    """Track before detect: an auxiliary particle filter of place, velocity and amplitude, with existence.

    Hu 2005, of which only the title is available ("auxiliary particle filter, track before detect"). Built from its
    parts: likelihood ratio and existence of D. Salmond, H. Birch, "A particle filter for track-before-detect", ACC
    2001; existence as a probability beside two sets of particles, continuing and born, of M. Rutten, N. Gordon, S.
    Maskell, "Recursive track-before-detect with target amplitude fluctuations", IEE Proc. Radar Sonar Navig. 152(5),
    2005; auxiliary filter of M. Pitt, N. Shephard, "Filtering via simulation", JASA 94(446), 1999, eq. 10 to 13:

        l(x) = prod exp((A h z - A^2 h^2 / 2) / sigma^2) over the image h of a target at x     (likelihood ratio)
        first stage w l(F x), second stage l(x) / l(F x)
        P(E | z_1..k) = L / (L + 1 - a - b),  a = (1 - death) P(E | z_1..k-1),  b = birth (1 - P(E | z_1..k-1))

    where L is the sum of the unnormalised weights of both sets. z is the white top-hat of the frame over its robust
    deviation sigma; h is a normal curve. The target is seen where P(E) >= 1/2. Elsewhere the estimate is the last one,
    moved on at its velocity.

    Chosen here, as no source is available: the motion noise; the random walk of ln A; the birth density, normal about
    the predicted place, wider with each frame without the target; births drawn half from that density and half from its
    product with l, weighted by density over proposal; `snr_limit`, since h does not fit an extended target to the
    precision that a bright one would require. The noise of a top-hat is not normal, so that l is approximate.
    """

    source: ClassVar[str] = "Hu 2005; Salmond, Birch 2001; Pitt, Shephard 1999"

    particles: int = Field(default=500, ge=2, le=100_000)
    """N, number of continuing particles."""
    births: int = Field(default=100, ge=1, le=100_000)
    """Number of born particles in each frame."""
    auxiliary: bool = True
    """True: ancestors are drawn by w l(F x). False: by w, the bootstrap filter."""
    whiten: Literal["tophat", "none"] = "tophat"
    """Background removed before the frame is divided by its deviation: the opening by a square larger than the target,
    or the median alone."""
    death: Fraction = 0.05
    """Probability that a target vanishes from one frame to the next."""
    birth: Fraction = 0.05
    """Probability that a target appears."""
    birth_place: Literal["track", "frame"] = "track"
    """Density of born targets: about the predicted place, or uniform over the frame."""
    psf: Annotated[float | None, Field(ge=LEAST_PSF, le=100)] = None
    """Standard deviation of the target's image on both axes, px; by default a quarter of each side of the start box."""
    snr_limit: Ratio = 8.0
    """Largest A sqrt(sum h^2) in the first frame; the frames of a brighter target are scaled down, noise included."""
    position_sd: Spread = 0.5
    """Standard deviation of the position noise, px."""
    speed_sd: Spread = 0.3
    """Standard deviation of the velocity noise on each axis, px/frame."""
    start_sd: Spread = 1.0
    """Standard deviation of the first particles on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    amplitude_sd: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Standard deviation of the random walk of ln A."""
    resampling: Resampling = "systematic"
    """Resampling scheme."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> APFTBDState:
        """Return the initial state: polarity and image of the target, and particles about the box's centre."""
        window, corner = start_window(frame, box)
        surround = region(frame.image, window, corner, (window.columns, window.rows))[2]
        sign = -1.0 if contrast(window.cut(frame.image, corner), surround) < 0 else 1.0
        sides = (box.w, box.h)
        psf = [max(side / 4 if self.psf is None else self.psf, LEAST_PSF) for side in sides]
        block = min(max(int(min(psf) / COARSE), 1), *frame.image.shape)
        psf = [sqrt(sd**2 + (block**2 - 1) / 12) / block for sd in psf]
        x, y = (np.arange(-reach, reach + 1.0) for reach in (ceil(2 * sd) for sd in psf))
        start = Start(footage(frame), sides, sign, block, (psf[0], psf[1]), x, y)
        z = self.whitened(frame.image, start)
        near = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3)), axis=-1).reshape(-1, 2) * block
        projected = self.projections(z, np.array([box.cx, box.cy]) + near, start)
        snr = float((projected[0] / np.sqrt(np.maximum(projected[1], NEVER))).max())
        start = replace(start, gain=min(self.snr_limit / max(snr, NEVER), 1.0))
        level = max(snr * start.gain, LEAST_SNR) / sqrt(start.energy)
        track = np.array([box.cx, box.cy, 0.0, 0.0])
        deviations = np.repeat([self.start_sd, self.start_speed_sd], 2)
        particles = track + deviations * rng.standard_normal((self.particles, 4))
        amplitudes = level * np.exp(UNKNOWN * self.amplitude_sd * rng.standard_normal((self.particles, 1)))
        return APFTBDState(
            start=start,
            particles=np.concatenate([particles, amplitudes], axis=1),
            weights=equal_weights(self.particles),
            existence=START_EXISTENCE,
            track=track,
            level=level,
            monitor=VisibilityMonitor(),
        )

    def step(self, state: APFTBDState, frame: Frame, rng: np.random.Generator) -> tuple[APFTBDState, Estimate]:
        """Whiten, draw ancestors, move, add births, weigh, decide on existence, estimate."""
        start = state.start
        start.footage.check(frame)
        z = self.whitened(frame.image, start)
        track = state.track.copy()
        if state.monitor.misses < self.lost_after:
            track[:2] += track[2:]
        predicted = state.particles.copy()
        predicted[:, :2] += predicted[:, 2:4]
        first = np.zeros(len(predicted))
        if self.auxiliary:
            ratios = self.log_ratios(z, predicted, start)
            first = np.where(ratios.visible > 0, ratios.lw, -np.inf)
        stage = Weights(first, state.weights)
        alive, born = (1 - self.death) * state.existence, self.birth * (1 - state.existence)
        factors = np.empty(0)

        def move(ancestors: Indices | None) -> Floats:
            nonlocal factors
            assert ancestors is not None
            new, densities = self.born(state, track, z, rng)
            continuing = self.moved(predicted.take(ancestors, axis=0), start, rng)
            # Where all first-stage weights are 0, ancestors are drawn evenly; their second-stage weights are 0, too.
            second = -np.where(stage.degenerate, 0.0, first.take(ancestors))
            whole = 0.0 if stage.degenerate else _log_sum(first, state.weights)
            kept = second + whole + log(max(alive / self.particles, NEVER))
            factors = np.concatenate([kept, densities + log(max(born / self.births, NEVER))])
            return np.concatenate([continuing, new])

        def likelihood(particles: Floats) -> Likelihood:
            found = self.log_ratios(z, particles, start)
            return Likelihood(found.lw + factors, 1.0, found.visible)

        step = smc_step(
            state.weights, lambda W: RESAMPLERS[self.resampling](stage.W, rng, self.particles), move, likelihood
        )
        particles, W = step.particles, step.W
        evidence = _log_sum(step.likelihood.lw, np.sign(step.likelihood.visible))
        existence = 1 / (1 + exp(min(log(max(1 - alive - born, NEVER)) - evidence, 700.0)))
        monitor, level = state.monitor.miss(), state.level
        if existence >= 0.5:
            average = mean(W, particles)
            monitor, track, level = state.monitor.hit(), average[:4], float(average[4])
        after = APFTBDState(start, particles, W, existence, track, level, monitor)
        status = monitor.status(self.lost_after)
        return after, particle_estimate(particles, W, track[:2], track[2:], start.size, status, existence)

    def whitened(self, image: Image, start: Start) -> Picture:
        """Return z (rows, columns) of a frame, in blocks: positive at targets, of unit deviation times `gain`."""
        picture, block = image.astype(np.float32), start.block
        if block > 1:
            rows, columns = (side // block * block for side in image.shape)
            size = (columns // block, rows // block)
            picture = cv2.resize(picture[:rows, :columns], size, interpolation=cv2.INTER_AREA)  # type: ignore[assignment]  # OpenCV's stubs know no element types
        picture = picture * np.float32(start.sign)
        if self.whiten == "tophat":
            sides = (2 * int(2 * max(start.psf) + 1) + 1,) * 2
            picture = cv2.morphologyEx(picture, cv2.MORPH_TOPHAT, np.ones(sides, np.uint8))  # type: ignore[assignment]
        middle, deviation = robust_scale(picture)
        z: Picture = (picture - np.float32(middle)) * np.float32(start.gain / deviation)
        return z

    def projections(self, z: Picture, places: Floats, start: Start) -> tuple[Floats, Floats]:
        """Return sum h z and sum h^2, (N,) each, over the images of targets at places (N, 2) px, inside the frame."""
        at = (places - (start.block - 1) / 2) / start.block
        lines, indices = [], []
        for axis, (offsets, side) in enumerate(((start.x, z.shape[1]), (start.y, z.shape[0]))):
            centers = np.clip(at[:, axis], -len(offsets) - 1.0, side + len(offsets))
            cells = np.floor(centers + 0.5)[:, None] + offsets
            line = np.exp(-((cells - centers[:, None]) ** 2) / (2 * start.psf[axis] ** 2))
            lines.append(line * ((cells >= 0) & (cells < side)))
            indices.append(np.clip(cells, 0, side - 1).astype(np.intp))
        patches = z[indices[1][:, :, None], indices[0][:, None, :]]
        along = np.matmul(patches, lines[0][:, :, None].astype(np.float32))[:, :, 0]
        squares: Floats = (lines[0] ** 2).sum(axis=1) * (lines[1] ** 2).sum(axis=1)
        return (along * lines[1]).sum(axis=1), squares

    def log_ratios(self, z: Picture, particles: Floats, start: Start) -> Likelihood:
        """Return ln l (N,) of particles (N, 5): target there against noise alone."""
        projected, squares = self.projections(z, particles[:, :2], start)
        amplitude = particles[:, 4]
        return Likelihood(amplitude * projected - 0.5 * amplitude**2 * squares, 1.0, squares)

    def moved(self, particles: Floats, start: Start, rng: np.random.Generator) -> Floats:
        """Return the particles with the noise of their motion and of their amplitude."""
        deviations = np.repeat([self.position_sd, self.speed_sd], 2)
        noise = rng.standard_normal(particles.shape)
        moved: Floats = particles.copy()
        moved[:, :4] += deviations * noise[:, :4]
        moved[:, 4] *= np.exp(self.amplitude_sd * noise[:, 4])
        np.maximum(moved[:, 4], FAINTEST_SNR / sqrt(start.energy), out=moved[:, 4])
        return moved

    def born(self, state: APFTBDState, track: Floats, z: Picture, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Draw new particles (M, 5); return them and ln(birth density / proposal density), (M,)."""
        start, (rows, columns) = state.start, z.shape
        at = np.clip((track[:2] - (start.block - 1) / 2) / start.block, 0, np.array([columns - 1, rows - 1]))
        deviation = (sqrt(start.size[0] * start.size[1]) / 2 + GROWTH * state.monitor.misses) / start.block
        reach = ceil(3 * deviation) if self.birth_place == "track" else max(rows, columns)
        left, top = (max(int(c) - reach, 0) for c in at)
        part = z[top : int(at[1]) + reach + 1, left : int(at[0]) + reach + 1]
        density = np.ones(part.shape)
        if self.birth_place == "track":
            x, y = (np.arange(n) + first - c for n, first, c in zip(part.shape[::-1], (left, top), at, strict=True))
            density = np.exp(-(x**2 + y[:, None] ** 2) / (2 * deviation**2))
        density = (density / density.sum()).ravel()
        projected = cv2.sepFilter2D(part, cv2.CV_32F, start.line(0), start.line(1), borderType=cv2.BORDER_CONSTANT)
        bright = Weights(state.level * projected.ravel().astype(np.float64), density)
        proposal = (density + bright.W) / 2
        chosen = multinomial(proposal, rng, self.births)
        cells = np.stack([chosen % part.shape[1] + left, chosen // part.shape[1] + top], axis=1)
        places = (cells + rng.random((self.births, 2)) - 0.5) * start.block + (start.block - 1) / 2
        noise = rng.standard_normal((self.births, 3))
        speeds = (track[2:] if self.birth_place == "track" else 0.0) + self.start_speed_sd * noise[:, :2]
        amplitudes = state.level * np.exp(UNKNOWN * self.amplitude_sd * noise[:, 2:])
        return np.concatenate([places, speeds, amplitudes], axis=1), np.log(density[chosen] / proposal[chosen])


def _log_sum(lw: Floats, weights: Floats) -> float:
    """Return ln sum w exp(lw); -inf where every term is 0."""
    kept = weights > 0
    top = float(lw[kept].max(initial=-np.inf))
    if top == -np.inf:
        return -1e300
    return top + log(float(weights[kept] @ np.exp(lw[kept] - top)))

"""`svd_pf`: small targets detected in a suppressed background within a particle filter's window."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.svd import Residual, candidates, largest_parts, standardised
from irtrack.filters import particle as cloud
from irtrack.filters.resampling import RESAMPLERS, Resampling
from irtrack.trackers.base import Deviation, Footage, Ratio, Sight, Spread, TrackerPart, footage, start_window
from irtrack.types import Estimate

MOST_CANDIDATES = 100
"""The highest count. A frame that shows more shows none."""
MOST_COMPONENTS = 10
"""That are tried where their number is left open."""
LARGEST_PX = 31
"""Side over which a residual is averaged at most: the method is one for small targets."""
POINT = (3, 3)
"""px over which a point target's light falls: boxes are larger, and would drown it."""
SHARPEST = 4.0
"""pf: z that a target is expected to have at most, so that one bright pixel does not take the whole cloud."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """size (w, h) px of the box; window: odd sides over which z is averaged; sign: 1 hot, -1 cold; components gone."""

    footage: Footage
    size: tuple[float, float]
    window: tuple[int, int]
    sign: float
    components: int


@dataclass(frozen=True, slots=True, eq=False)
class SVDPFState:
    """particles (N, 4): x, y px, vx, vy px/frame; weights (N,)."""

    start: Start
    particles: Floats
    weights: Floats
    sight: Sight


class SVDPF(TrackerPart):
    """Singular values suppress the background, candidates are what is left, a particle filter says where to look.

    L. Cui, J. Zheng, X. Li 2011 (see `irtrack.features.svd`), of which only the summary is at hand:
    SVD filtering gives candidates in each frame, a particle filter estimates the motion and gives a
    search window, and the two are joined, so that what a frame misses is predicted, and a wrong
    prediction is mended by candidates.

    All the rest is chosen here. Which singular values go: the largest `components`; without a value as
    many as let the target stand out most in the first frame, since a target that is large for its frame
    is itself among the large ones. Candidates are maxima of the mean over the target's box, or over 3x3
    px where it stands out more by that, above `threshold` standard deviations. The window is `gate`
    deviations of the predicted cloud and half the box; of the candidates in it the highest is the target.
    With none in it the particles are weighed by z where they are, as with the filter alone. With none in
    it for `wrong_after` frames, the cloud starts anew at the highest in the frame.
    """

    source: ClassVar[str] = "Cui, Zheng, Li 2011"

    use: Literal["joint", "svd", "pf"] = "joint"
    """Both joined; the highest candidate of each frame alone; or the particle filter alone, which weighs
    by z itself (likelihood ratio of a known amplitude in normal noise, exp(A z - A^2 / 2))."""
    components: Annotated[int | None, Field(ge=0, le=50)] = None
    """Largest singular values that go; 0: none; without a value, see above."""
    threshold: Ratio = 4.0
    """z of a candidate; of unit normal noise one of some 30,000 places passes 4."""
    particles: int = Field(default=100, ge=2, le=1_000_000)
    """N, number of particles."""
    position_sd: Spread = 0.5
    """Noise of the place, px."""
    speed_sd: Spread = 0.3
    """Noise of the speed, px/frame."""
    start_speed_sd: Spread = 2.0
    """Spread of the first cloud's speed on each axis, px/frame."""
    measurement_sd: Deviation = 1.0
    """Standard deviation of a candidate's place on each axis, px."""
    gate: Ratio = 3.0
    """Half side of the search window in standard deviations of the predicted cloud, beyond half the box."""
    resampling: Resampling = "systematic"
    """How particles are drawn, where Neff is below N / 2."""
    wrong_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without a candidate in the window from which on the whole frame is searched."""
    seen: Fraction = 0.3
    """Share of the way from the threshold to the target's usual z that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without sight after which the status is lost."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> SVDPFState:
        """Polarity and number of components by the first frame; a cloud about the box's centre."""
        part, (left, top) = start_window(frame, box)
        parts = largest_parts(frame.image, MOST_COMPONENTS if self.components is None else self.components, rng)
        tried = range(MOST_COMPONENTS + 1) if self.components is None else [self.components]
        # The middle of what can be seen of the box.
        row, column = top + part.rows // 2, left + part.columns // 2
        level = float(frame.image.max())
        heights = {
            (window, k): float(standardised(parts.less(k), window, 1.0, level)[row, column])
            for window in {(_odd(box.w), _odd(box.h)), POINT}
            for k in tried
        }
        window, components = max(sorted(heights), key=lambda choice: abs(heights[choice]))
        sign = 1.0 if heights[window, components] >= 0 else -1.0
        start = Start(footage(frame), (box.w, box.h), window, sign, components)
        return SVDPFState(
            start=start,
            particles=self._cloud(np.array([box.cx, box.cy, 0.0, 0.0]), rng),
            weights=np.full(self.particles, 1 / self.particles),
            sight=Sight(),
        )

    def step(self, state: SVDPFState, frame: Frame, rng: np.random.Generator) -> tuple[SVDPFState, Estimate]:
        """Suppress, predict, look in the window, weigh, estimate, resample."""
        start = state.start
        start.footage.check(frame)
        z = self.standardised(frame.image, start, rng)
        spread = np.repeat([self.position_sd, self.speed_sd], 2)
        particles: Floats = state.particles + spread * rng.standard_normal(state.particles.shape)
        particles[:, :2] += state.particles[:, 2:]
        if self.use == "pf":
            particles, weights, score, sight = self._weighed(state, particles, z)
        else:
            particles, weights, score, sight = self._detected(state, particles, z, rng)
        mean = cloud.mean(weights, particles)
        x, y, vx, vy = mean.tolist()
        neff = float(cloud.neff(weights))
        estimate = Estimate(
            center=(x, y),
            size=start.size,
            status=sight.status(self.lost_after),
            score=score,
            velocity=(vx, vy),
            covariance=cloud.covariance(weights, particles[:, :2], mean[:2]),
            neff=neff,
            particles=particles,
            weights=weights,
        )
        if neff < self.particles / 2:
            particles = particles[RESAMPLERS[self.resampling](weights, rng)]
            weights = np.full(self.particles, 1 / self.particles)
        return replace(state, particles=particles, weights=weights, sight=sight), estimate

    def standardised(self, image: Image, start: Start, rng: np.random.Generator) -> Residual:
        """z (rows, columns) of a frame, in which candidates are looked for; positive for targets."""
        residual = largest_parts(image, start.components, rng).less(start.components)
        return standardised(residual, start.window, start.sign, float(image.max()))

    def _detected(
        self, state: SVDPFState, particles: Floats, z: Residual, rng: np.random.Generator
    ) -> tuple[Floats, Floats, float, Sight]:
        """Particles and weights after the best candidate of the window, or of the frame; its z, and the sight."""
        start = state.start
        centers, heights = candidates(z, start.window, self.threshold, MOST_CANDIDATES)
        predicted = cloud.mean(state.weights, particles)[:2]
        if self.use == "joint":
            deviation = np.sqrt(np.diag(cloud.covariance(state.weights, particles[:, :2], predicted)))
            inside = (np.abs(centers - predicted) <= self.gate * deviation + np.array(start.size) / 2).all(axis=1)
            if inside.any():
                first = int(inside.argmax())  # the highest come first
                sight = state.sight.after(float(heights[first]), self.threshold, self.seen)
                if sight.missed == 0:
                    weights = self._about(centers[first], state.weights, particles)
                    return particles, weights, float(heights[first]), sight
        everywhere = self.use == "svd" or state.sight.missed + 1 >= self.wrong_after
        if everywhere and len(centers) > 0:
            sight = state.sight.after(float(heights[0]), self.threshold, self.seen)
            if sight.missed == 0:
                velocity = cloud.mean(state.weights, particles)[2:]
                return (
                    self._cloud(np.concatenate([centers[0], velocity]), rng),
                    np.full(self.particles, 1 / self.particles),
                    float(heights[0]),
                    sight,
                )
        if self.use == "svd":
            return particles, state.weights, 0.0, state.sight.unseen()
        particles, weights, score, _ = self._weighed(state, particles, z)
        return particles, weights, score, state.sight.unseen()

    def _weighed(self, state: SVDPFState, particles: Floats, z: Residual) -> tuple[Floats, Floats, float, Sight]:
        """Particles weighed by z where they are; those outside the frame see none."""
        columns, rows = np.floor(particles[:, :2].T + 0.5)
        inside = (columns >= 0) & (columns < z.shape[1]) & (rows >= 0) & (rows < z.shape[0])
        heights = np.zeros(len(particles))
        heights[inside] = z[rows[inside].astype(np.intp), columns[inside].astype(np.intp)]
        amplitude = min(max(state.sight.level or self.threshold, 0.0), SHARPEST)
        weights = _reweighed(state.weights, heights, amplitude)
        score = float(weights @ heights)
        return particles, weights, score, state.sight.after(score, self.threshold, self.seen)

    def _about(self, center: Floats, before: Floats, particles: Floats) -> Floats:
        """Weights by the distance from a candidate, whose place is normal about the target's."""
        squares = ((particles[:, :2] - center) ** 2).sum(axis=1) / self.measurement_sd**2
        return _reweighed(before, -squares, 0.5)

    def _cloud(self, at: Floats, rng: np.random.Generator) -> Floats:
        """(N, 4) particles about a place that is known, and a velocity that is not."""
        spread = np.repeat([self.measurement_sd if self.use != "svd" else 0.0, self.start_speed_sd], 2)
        return at + spread * rng.standard_normal((self.particles, 4))


def _reweighed(before: Floats, score: Floats, sharpness: float) -> Floats:
    """`cloud.reweigh` where something is always left: weights sum to one, and scores are finite."""
    weights = cloud.reweigh(before, score, sharpness)
    assert weights is not None
    return weights


def _odd(side: float) -> int:
    """The odd number of px next to a side, so that the mean has a middle pixel."""
    return min(2 * int(side / 2) + 1, LARGEST_PX)

"""What the camera does."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds import Recorded
from irsim.camera.motion_blur import MAX_STEPS
from irsim.camera.noise_base import Noise, NoiseVariance
from irsim.camera.sensor import NETD_K
from irsim.errors import Notice
from irsim.lint.looked import watched
from irsim.motion import CameraTrajectory, Tracks
from irsim.physics.radiometry import radiance
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import LOOKED, Watch
from irsim.types import Floats

LOWEST_M = 0.1
"""Backgrounds are drawn from so far above the ground or the sea at least."""
ROUNDING_M = 1e-6
"""Sums of metres are off by far less, and nobody sees so little."""
BEADS_PX = 1.2
"""Two blurs of the usual sigma, 0.6 px: points farther apart than these are told from each other."""


NOISIEST_MK = 1000.0
"""A round bound of our own: cameras of the trade have some 20 to 100 mK."""


def noisy(scenario: Scenario) -> Iterator[Notice]:
    """A NETD written in other units, say; not one that severities or ranges raise on purpose."""
    camera, key = scenario.camera, "netd_mk"
    meant = {"camera", f"camera.{key}"} & {*scenario.severities, *scenario.vary}
    if camera.netd_mk > NOISIEST_MK and key in camera.detector.camera_keys and not meant:
        yield Notice(
            ("camera", key),
            f"{camera.netd_mk:g} mK is allowed but hardly meant: {camera.netd_mk / 1000:g} K; "
            f"plausible: up to {NOISIEST_MK:g} mK",
        )


FINEST = 0.3
"""Counts: rounding makes of less what hangs on where between two counts a pixel lies, 0.11 to 0.50 of a sigma of 0.2.
Of 0.3 it makes 0.31 to 0.50, over all pixels the root of the sum of both variances, within 1 %."""

NO_NOISE = 1e-3
"""Counts: so little stands for none, as a fit of a camera without noise writes it."""


def rounded_off(scenario: Scenario) -> Iterator[Notice]:
    """Noise so far below one count that a still picture hardly changes; not where footage has the noise, or none is
    wanted."""
    camera = scenario.camera
    if isinstance(scenario.background, Recorded):
        return
    sensor = camera.signal_chain(scenario.seed, scenario.is_on)
    moment, response = sensor.frame_context(0, (1, 1)), sensor.response
    signal = response.at(float(radiance(camera.band, NETD_K)))
    variance = NoiseVariance.total(noise.variance_terms(moment, False) for noise in sensor.noises).overall(
        signal, response
    )
    counts = math.sqrt(variance) / response.gain
    if NO_NOISE < counts < FINEST:
        yield Notice(
            ("camera", "bits"),
            f"the noise at {NETD_K:g} K is {counts:.2g} counts: rounding to whole counts hides it, and pixels stay as "
            f"they are or go to and fro between two counts; {FINEST:g} or more take more bits or a smaller range",
        )


def uncounted(scenario: Scenario) -> Iterator[Notice]:
    """Electrons that do not vary from frame to frame, as a list of noises takes the place of the detector's own; not
    where white noise stands for theirs, no noise at all is wanted, or footage has it."""
    camera = scenario.camera
    wanted = camera.detector.counts_electrons and camera.noise and not isinstance(scenario.background, Recorded)
    drawn = Noise.draw_electrons, Noise.temporal_sigma
    if wanted and all((type(noise).draw_electrons, type(noise).temporal_sigma) == drawn for noise in camera.noise):
        yield Notice(
            ("camera", "noise"),
            "electrons are read without shot and read noise: a list of noises takes the place of the detector's own; "
            "{kind: shot} has both",
        )


def follows_nobody(scenario: Scenario) -> Iterator[Notice]:
    """A camera that turns after a target that is switched off, and so is in no picture."""
    for index, motion in enumerate(scenario.camera.motion):
        if isinstance(motion, Tracks) and not scenario.is_on(motion.target):
            yield Notice(
                ("camera", "motion", index, "target"),
                f"{motion.target} is switched off, and the camera follows it all the same; without {motion.name} as "
                "well it does not",
            )


def sunken(scenario: Scenario) -> Iterator[Notice]:
    """A camera that is carried below the ground or the sea: the background's, or what targets go on."""
    context, background = scenario.context, scenario.background
    shown = (target for target in scenario.targets if scenario.is_on(target.id))
    under = [height for target in shown if (height := target.path.level_m) is not None]
    height = min(under, default=math.inf) if background.surface_m is None else background.surface_m
    frames, least = watched(scenario.frames, LOOKED), min(LOWEST_M, height - ROUNDING_M)
    sinks = {
        index: motion.shifts(frames, context) @ context.geometry.down
        for index, motion in enumerate(scenario.shown.camera.motion)
        if scenario.is_on(motion.name)
    }
    left = height - np.sum([np.zeros(len(frames)), *sinks.values()], axis=0)
    if left.min() < least:
        first = int(np.argmax(left < least))
        yield Notice(
            ("camera", "motion", max(sinks, key=lambda index: sinks[index][first])),
            f"at frame {frames[first]:.0f} the camera has come down to the {background.surface}, {height:g} m under "
            f"its first place; it sinks by {height - left.min():.3g} m",
        )


def beads(scenario: Scenario) -> Iterator[Notice]:
    """Of a smear with too few steps: who moves most while a frame is exposed, by what it does from frame to frame."""
    camera = scenario.camera
    smear = camera.smear if scenario.is_on("smear") else None
    if smear is None or camera.exposure_ms == 0 or smear.steps == 1 or scenario.frames == 1:
        return
    watch = Watch(scenario)
    share = camera.exposure_ms * 1e-3 * camera.rate_hz / smear.steps
    moves = [(_turning(watch.mount), "the background")]
    for name, course in watch.courses.items():
        pixels = watch.mount.seen(course.positions)
        in_view = np.array([camera.geometry.inside(x, y) for x, y in pixels.tolist()])
        steps = np.hypot(*np.diff(pixels, axis=0).T)
        moves.append((np.where(in_view[1:] & in_view[:-1], steps, 0.0), name))
    most, name, frame = max((float(steps.max()) * share, name, int(steps.argmax()) + 1) for steps, name in moves)
    if most > BEADS_PX:
        enough = math.ceil(most * smear.steps / BEADS_PX)
        yield Notice(
            ("camera", "smear", "steps"),
            f"at frame {frame} {name} moves by {most:.1f} px from step to step, which leaves beads; "
            f"a streak takes steps: {enough}" + (", more than there may be" if enough > MAX_STEPS else ""),
        )


def _turning(mount: CameraTrajectory) -> Floats:
    """(n - 1,) px by which what is far and in the middle of the picture moves from frame to frame."""
    ahead = np.einsum("nij,nj->ni", mount.rotations[1:], mount.rotations[:-1, 2])
    shifts = mount.geometry.project(ahead) - mount.geometry.principal
    return np.asarray(np.hypot(*shifts.T) * mount.zooms[1:])

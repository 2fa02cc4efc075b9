"""A twin-engined jet airliner."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Kelvin, Length
from irsim.motion.attitude import AEROPLANE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Solid, mirrored, plate, profile, shifted, tilted, tube

# Proportions of the common single-aisle twins: 37.6 m long, 34 m span, 4 m across.
_RISE = 0.1
_INNER = tilted(plate(((0.135, 0.03), (0.05, 0.18), (-0.085, 0.18), (-0.09, 0.03)), 0.032, 0.05), _RISE)
_OUTER = tilted(plate(((0.05, 0.18), (-0.105, 0.46), (-0.145, 0.46), (-0.085, 0.18)), 0.036, 0.046), _RISE)
_TAILPLANE = tilted(plate(((-0.375, 0.02), (-0.455, 0.18), (-0.495, 0.18), (-0.475, 0.02)), -0.03, -0.018), _RISE)
_COWL = shifted(tube((0.13, 0.0, 0.026, 0.026), (0.09, 0.0, 0.031, 0.031), (0.01, 0.0, 0.024, 0.024)), (0, 0.165, 0.06))
_NOZZLE = shifted(
    tube((0.012, 0.0, 0.02, 0.02), (-0.04, 0.0, 0.012, 0.012), heat="engine_k"),
    (0, 0.165, 0.06),
)
_PYLON = profile(((0.09, 0.035), (-0.03, 0.02), (-0.03, 0.035), (0.02, 0.045)), 0.161, 0.169)


class Airliner(Body):
    """A twin-jet airliner: long fuselage, swept wings, an engine with a hot nozzle under each."""

    lies: ClassVar[Posture] = AEROPLANE
    poses: ClassVar[tuple[Angles, ...]] = ((60.0, 20.0, 25.0), (90.0, 0.0, 0.0), (20.0, 10.0, -60.0))
    # In a jet stream: 825 mph over the ground, 369 m/s (a Boeing 747 over the Atlantic, February 2020).
    fastest_m_s: ClassVar[float | None] = 370.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.5, 0.012, 0.006, 0.006),
            (0.475, 0.008, 0.03, 0.028),
            (0.44, 0.002, 0.046, 0.045),
            (0.39, 0, 0.053, 0.053),
        ),
        tube((0.39, 0.0, 0.053, 0.053), (-0.2, 0.0, 0.053, 0.053)),
        tube((-0.2, 0.0, 0.053, 0.053), (-0.36, -0.018, 0.036, 0.036), (-0.5, -0.035, 0.01, 0.012)),
        _INNER,
        mirrored(_INNER),
        _OUTER,
        mirrored(_OUTER),
        _TAILPLANE,
        mirrored(_TAILPLANE),
        profile(((-0.33, -0.045), (-0.445, -0.205), (-0.5, -0.205), (-0.47, -0.045)), -0.006, 0.006),
        _COWL,
        mirrored(_COWL),
        _NOZZLE,
        mirrored(_NOZZLE),
        _PYLON,
        mirrored(_PYLON),
    )

    length_m: Length = 37.6
    """Length, m."""
    temperature_k: Kelvin = 272.0
    """Temperature of the skin, kelvin: air at cruising height is cold, friction warms it by some 25 K."""
    engine_k: Kelvin = 420.0
    """Temperature of the nozzles, kelvin."""

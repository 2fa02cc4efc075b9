"""Aircraft with wings: fighter, airliner and missile."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.motion.attitude import AEROPLANE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.parts import Solid, mirrored, plate, profile, shifted, tilted, tube

_FIGHTER_WING = plate(((0.13, 0.02), (-0.13, 0.32), (-0.20, 0.32), (-0.23, 0.02)), -0.006, 0.006)
_FIGHTER_TAILPLANE = plate(((-0.32, 0.02), (-0.43, 0.18), (-0.49, 0.18), (-0.47, 0.02)), -0.005, 0.005)


class Fighter(Body):
    """A jet with cropped delta wings, one fin and a hot nozzle that is visible from behind only."""

    default_posture: ClassVar[Posture] = AEROPLANE
    picture_poses: ClassVar[tuple[Angles, ...]] = ((70.0, 10.0, -50.0), (90.0, 0.0, 0.0), (20.0, 10.0, -60.0))
    # MiG-25: Mach 3 at altitude for short dashes, 885 m/s (Mach 2.83 sustained).
    max_speed_m_s: ClassVar[float | None] = 900.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube((0.5, 0.01, 0.004, 0.004), (0.41, 0.005, 0.02, 0.02), (0.22, 0.0, 0.043, 0.043)),
        tube(
            (0.30, 0.0, 0.036, 0.036), (0.08, 0.0, 0.056, 0.053), (-0.22, 0.0, 0.056, 0.053), (-0.42, 0.0, 0.042, 0.042)
        ),
        tube(
            (0.33, -0.035, 0.008, 0.008),
            (0.22, -0.05, 0.027, 0.03),
            (0.14, -0.045, 0.02, 0.02),
            (0.06, -0.035, 0.01, 0.01),
        ),
        plate(((0.20, -0.035), (0.20, 0.035), (-0.1, 0.03), (-0.1, -0.03)), 0.02, 0.085),
        _FIGHTER_WING,
        mirrored(_FIGHTER_WING),
        _FIGHTER_TAILPLANE,
        mirrored(_FIGHTER_TAILPLANE),
        profile(((-0.20, -0.03), (-0.40, -0.23), (-0.47, -0.23), (-0.45, -0.03)), -0.006, 0.006),
        tube((-0.40, 0.0, 0.041, 0.041), (-0.5, 0.0, 0.033, 0.033), material="engine_k"),
    )

    length_m: Length = 15.0
    """Length, m."""
    engine_k: Kelvin = 400.0
    """Temperature of the outside of the nozzle, kelvin."""


# Proportions of the common single-aisle twins: 37.6 m long, 34 m span, 4 m across.
_DIHEDRAL = 0.1
_INNER_WING = tilted(plate(((0.135, 0.03), (0.05, 0.18), (-0.085, 0.18), (-0.09, 0.03)), 0.032, 0.05), _DIHEDRAL)
_OUTER_WING = tilted(plate(((0.05, 0.18), (-0.105, 0.46), (-0.145, 0.46), (-0.085, 0.18)), 0.036, 0.046), _DIHEDRAL)
_STABILISER = tilted(plate(((-0.375, 0.02), (-0.455, 0.18), (-0.495, 0.18), (-0.475, 0.02)), -0.03, -0.018), _DIHEDRAL)
_COWL = shifted(tube((0.13, 0.0, 0.026, 0.026), (0.09, 0.0, 0.031, 0.031), (0.01, 0.0, 0.024, 0.024)), (0, 0.165, 0.06))
_NOZZLE = shifted(tube((0.012, 0.0, 0.02, 0.02), (-0.04, 0.0, 0.012, 0.012), material="engine_k"), (0, 0.165, 0.06))
_PYLON = profile(((0.09, 0.035), (-0.03, 0.02), (-0.03, 0.035), (0.02, 0.045)), 0.161, 0.169)


class Airliner(Body):
    """A twin-jet airliner: long fuselage, swept wings, an engine with a hot nozzle under each."""

    default_posture: ClassVar[Posture] = AEROPLANE
    picture_poses: ClassVar[tuple[Angles, ...]] = ((60.0, 20.0, 25.0), (90.0, 0.0, 0.0), (20.0, 10.0, -60.0))
    # Ground speed in a jet stream: 825 mph, 369 m/s (a Boeing 747 over the Atlantic, February 2020).
    max_speed_m_s: ClassVar[float | None] = 370.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.5, 0.012, 0.006, 0.006),
            (0.475, 0.008, 0.03, 0.028),
            (0.44, 0.002, 0.046, 0.045),
            (0.39, 0, 0.053, 0.053),
        ),
        tube((0.39, 0.0, 0.053, 0.053), (-0.2, 0.0, 0.053, 0.053)),
        tube((-0.2, 0.0, 0.053, 0.053), (-0.36, -0.018, 0.036, 0.036), (-0.5, -0.035, 0.01, 0.012)),
        _INNER_WING,
        mirrored(_INNER_WING),
        _OUTER_WING,
        mirrored(_OUTER_WING),
        _STABILISER,
        mirrored(_STABILISER),
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
    """Temperature of the skin, kelvin: about 25 K above the cold air at cruising height, by friction."""
    engine_k: Kelvin = 420.0
    """Temperature of the nozzles, kelvin."""


_SIDE_FIN = plate(((-0.36, 0.025), (-0.44, 0.16), (-0.5, 0.16), (-0.5, 0.025)), -0.005, 0.005)
_MISSILE_WING = plate(((0.12, 0.025), (0.02, 0.13), (-0.04, 0.13), (-0.06, 0.025)), -0.005, 0.005)
_TOP_FIN = profile(((-0.36, -0.025), (-0.44, -0.16), (-0.5, -0.16), (-0.5, -0.025)), -0.005, 0.005)
_BOTTOM_FIN = profile(((-0.36, 0.025), (-0.44, 0.16), (-0.5, 0.16), (-0.5, 0.025)), -0.005, 0.005)


class Missile(Body):
    """A slender missile with wings and fins, a seeker dome heated by friction, and a bright plume.

    The plume is part of the body, so box and centre include it. Its emissivity is low, but it is opaque.
    """

    picture_poses: ClassVar[tuple[Angles, ...]] = ((70.0, 20.0, 45.0), (90.0, 0.0, 0.0), (50.0, 35.0, 20.0))
    # R-37M, an air-to-air missile: Mach 6 at altitude, 1800 m/s. Ballistic missiles are excluded.
    max_speed_m_s: ClassVar[float | None] = 2000.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube((0.5, 0.0, 0.008, 0.008), (0.475, 0.0, 0.022, 0.022), (0.44, 0.0, 0.032, 0.032), material="dome_k"),
        tube((0.44, 0.0, 0.032, 0.032), (-0.5, 0.0, 0.036, 0.036)),
        _MISSILE_WING,
        mirrored(_MISSILE_WING),
        _SIDE_FIN,
        mirrored(_SIDE_FIN),
        _TOP_FIN,
        _BOTTOM_FIN,
        tube((-0.5, 0.0, 0.03, 0.03), (-0.58, 0.0, 0.055, 0.055), (-0.66, 0.0, 0.058, 0.058), material="plume_k"),
        tube((-0.66, 0.0, 0.056, 0.056), (-0.88, 0.0, 0.05, 0.05), material="flame_k"),
        tube((-0.88, 0.0, 0.045, 0.045), (-1.2, 0.0, 0.008, 0.008), material="smoke_k"),
    )

    length_m: Length = 3.0
    """Length without the plume, m; the plume is 0.7 times as long."""
    temperature_k: Kelvin = 330.0
    """Temperature of the skin, kelvin."""
    dome_k: Kelvin = 380.0
    """Temperature of the seeker's dome, kelvin."""
    plume_k: Kelvin = 1300.0
    """Temperature of the plume at the nozzle, kelvin."""
    plume_emissivity: Fraction = 0.3
    """Emissivity of the plume at the nozzle."""
    flame_k: Kelvin = 1000.0
    """Temperature of the middle of the plume, kelvin."""
    flame_emissivity: Fraction = 0.2
    """Emissivity of the middle of the plume."""
    smoke_k: Kelvin = 700.0
    """Temperature of the plume's end, kelvin."""
    smoke_emissivity: Fraction = 0.12
    """Emissivity of the plume's end."""

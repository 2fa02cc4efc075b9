"""A missile under power."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Solid, mirrored, plate, profile, tube

_FIN = plate(((-0.36, 0.025), (-0.44, 0.16), (-0.5, 0.16), (-0.5, 0.025)), -0.005, 0.005)
_WING = plate(((0.12, 0.025), (0.02, 0.13), (-0.04, 0.13), (-0.06, 0.025)), -0.005, 0.005)
_TOP_FIN = profile(((-0.36, -0.025), (-0.44, -0.16), (-0.5, -0.16), (-0.5, -0.025)), -0.005, 0.005)
_BOTTOM_FIN = profile(((-0.36, 0.025), (-0.44, 0.16), (-0.5, 0.16), (-0.5, 0.025)), -0.005, 0.005)


class Missile(Body):
    """A slender missile with wings and fins, its seeker's dome hot by friction, and a bright plume behind it.

    The plume is part of the body: it counts for box and centre. It is thin gas, so its emissivity is
    low, but nothing is seen through it.
    """

    poses: ClassVar[tuple[Angles, ...]] = ((70.0, 20.0, 45.0), (90.0, 0.0, 0.0), (50.0, 35.0, 20.0))
    # Of air-to-air missiles the R-37M, Mach 6 at height: 1800 m/s. Ballistic ones are another matter.
    fastest_m_s: ClassVar[float | None] = 2000.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube((0.5, 0.0, 0.008, 0.008), (0.475, 0.0, 0.022, 0.022), (0.44, 0.0, 0.032, 0.032), heat="dome_k"),
        tube((0.44, 0.0, 0.032, 0.032), (-0.5, 0.0, 0.036, 0.036)),
        _WING,
        mirrored(_WING),
        _FIN,
        mirrored(_FIN),
        _TOP_FIN,
        _BOTTOM_FIN,
        tube((-0.5, 0.0, 0.03, 0.03), (-0.58, 0.0, 0.055, 0.055), (-0.66, 0.0, 0.058, 0.058), heat="plume_k"),
        tube((-0.66, 0.0, 0.056, 0.056), (-0.88, 0.0, 0.05, 0.05), heat="flame_k"),
        tube((-0.88, 0.0, 0.045, 0.045), (-1.2, 0.0, 0.008, 0.008), heat="smoke_k"),
    )

    length_m: Length = 3.0
    """Length, m; the plume adds 0.7 of it."""
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

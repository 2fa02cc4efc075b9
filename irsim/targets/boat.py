"""A small ship."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.motion.attitude import UPRIGHT, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Solid, block, limb, mirrored, profile

# What is above the water of a patrol boat of 25 m, the water line at z = 0.
_WINDOWS = block((0.05, 0.088, -0.2), (0.2, 0.094, -0.165), "windows_k")


class Boat(Body):
    """A patrol boat above its water line: hull, deck house with windows, mast, and a hot funnel."""

    lies: ClassVar[Posture] = UPRIGHT
    grounded: ClassVar[bool] = True
    poses: ClassVar[tuple[Angles, ...]] = ((115.0, 0.0, 0.0), (90.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    behind_k: ClassVar[float] = 282.0
    from_above_deg: ClassVar[float] = 4.0
    # The Skjold class of patrol boats: 60 kn, 31 m/s; the hydrofoil HMCS Bras d'Or: 63 kn (1969).
    fastest_m_s: ClassVar[float | None] = 40.0
    solids: ClassVar[tuple[Solid, ...]] = (
        Solid(
            (
                *((x, side * y, -0.09) for side in (-1, 1) for x, y in ((-0.5, 0.1), (0.18, 0.12), (-0.1, 0.125))),
                (0.5, 0.0, -0.125),
                (0.36, 0.07, -0.112),
                (0.36, -0.07, -0.112),
                *((x, side * y, 0.0) for side in (-1, 1) for x, y in ((-0.48, 0.09), (0.12, 0.09))),
                (0.42, 0.0, 0.0),
            ),
            "hull_k",
        ),
        profile(((0.24, -0.095), (0.21, -0.15), (-0.26, -0.15), (-0.26, -0.09)), -0.09, 0.09),
        profile(((0.21, -0.15), (0.17, -0.225), (0.0, -0.225), (-0.02, -0.15)), -0.085, 0.085),
        _WINDOWS,
        mirrored(_WINDOWS),
        Solid(
            (
                (0.207, -0.075, -0.163),
                (0.207, 0.075, -0.163),
                (0.187, -0.075, -0.2),
                (0.187, 0.075, -0.2),
                (0.195, -0.075, -0.16),
                (0.195, 0.075, -0.16),
                (0.175, -0.075, -0.2),
                (0.175, 0.075, -0.2),
            ),
            "windows_k",
        ),
        profile(((-0.08, -0.15), (-0.1, -0.25), (-0.18, -0.25), (-0.18, -0.15)), -0.04, 0.04, "funnel_k"),
        limb((0.02, 0.0, -0.22), (-0.01, 0.0, -0.42), 0.012, 0.006),
        block((-0.012, -0.055, -0.34), (0.012, 0.055, -0.328)),
        block((-0.46, -0.05, -0.13), (-0.34, 0.05, -0.09)),
    )

    length_m: Length = 25.0
    """Length, m."""
    temperature_k: Kelvin = 294.0
    """Temperature of the deck house and mast, kelvin."""
    hull_k: Kelvin = 291.0
    """Temperature of the hull, kelvin."""
    funnel_k: Kelvin = 325.0
    """Temperature of the funnel, kelvin."""
    windows_k: Kelvin = 284.0
    """Apparent temperature of the windows, kelvin."""
    windows_emissivity: Fraction = 0.9
    """Emissivity of the windows: glass in the thermal infrared."""

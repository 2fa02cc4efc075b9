"""A helicopter with turning rotors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from irsim.config.base import Switches
from irsim.config.quantities import Fraction, Kelvin, Length, NotNegative
from irsim.motion.attitude import HELICOPTER, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.joints import Rigid, Turn, hinge, turned
from irsim.targets.solids import Solid, ball, block, limb, mirrored, on, plate, profile, shifted, tube

_MAST = (0.1, 0.0, -0.24)
_TAIL = (-0.56, 0.035, -0.2)


def _blade(quarter: int) -> Solid:
    """One of the four main blades, a quarter of a turn from the one before."""
    along = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter]
    corners = ((0.023, 0.018), (0.56, 0.018), (0.56, -0.018), (0.023, -0.018))
    outline = tuple((r * along[0] - s * along[1] + _MAST[0], r * along[1] + s * along[0]) for r, s in corners)
    return plate(outline, _MAST[2] - 0.008, _MAST[2] + 0.004, "rotor_k")


_TAIL_BLADES = tuple(
    shifted(profile(outline, -0.006, 0.006, "rotor_k"), _TAIL)
    for outline in (
        ((0.09, 0.014), (0.09, -0.014), (-0.09, -0.014), (-0.09, 0.014)),
        ((0.014, 0.09), (-0.014, 0.09), (-0.014, -0.09), (0.014, -0.09)),
    )
)
_WINDOW = Solid(
    ((0.43, 0.072, 0.0), (0.3, 0.094, 0.0), (0.3, 0.082, -0.075), (0.39, 0.05, -0.07), (0.3, 0.05, -0.05)), "windows_k"
)
_SKID = limb((0.38, 0.085, 0.165), (-0.06, 0.085, 0.165), 0.01, 0.01)
_STRUTS = tuple(limb((x, 0.085, 0.165), (x, 0.05, 0.08), 0.009, 0.009) for x in (0.28, 0.03))
_EXHAUST = shifted(tube((-0.08, -0.155, 0.03, 0.03), (-0.14, -0.16, 0.026, 0.026), heat="engine_k"), (0.0, 0.045, 0.0))


class Helicopter(Body):
    """A four-bladed helicopter: cabin, tail boom, turning main and tail rotor, hot exhausts below the mast."""

    lies: ClassVar[Posture] = HELICOPTER
    switches: ClassVar[Switches] = {"rotor": ("rotor_hz", 0.0)}
    alike: ClassVar[Mapping[str, int]] = {"rotor_hz": 4}
    poses: ClassVar[tuple[Angles, ...]] = ((65.0, -4.0, 8.0), (90.0, 0.0, 0.0), (150.0, 0.0, 0.0))
    # The Eurocopter X3, which has propellers too: 255 kn, 131 m/s (2013); the Westland Lynx of 1986: 111 m/s.
    fastest_m_s: ClassVar[float | None] = 135.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.47, 0.04, 0.03, 0.03),
            (0.42, 0.025, 0.068, 0.065),
            (0.31, -0.002, 0.09, 0.1),
            (0.04, -0.005, 0.09, 0.105),
        ),
        tube((0.04, -0.005, 0.09, 0.105), (-0.08, -0.035, 0.06, 0.07), (-0.16, -0.055, 0.035, 0.04)),
        tube((-0.12, -0.055, 0.035, 0.036), (-0.54, -0.085, 0.018, 0.02)),
        profile(((-0.46, -0.08), (-0.55, -0.235), (-0.6, -0.235), (-0.56, -0.07)), -0.009, 0.009),
        plate(((-0.42, -0.13), (-0.42, 0.13), (-0.48, 0.13), (-0.48, -0.13)), -0.09, -0.078),
        block((-0.08, -0.06, -0.17), (0.2, 0.06, -0.1)),
        _EXHAUST,
        mirrored(_EXHAUST),
        limb((_MAST[0], 0.0, -0.16), _MAST, 0.022, 0.016, "engine_k"),
        _WINDOW,
        mirrored(_WINDOW),
        ball((0.4, 0.0, 0.095), (0.035, 0.035, 0.03), "windows_k"),
        _SKID,
        mirrored(_SKID),
        *_STRUTS,
        *map(mirrored, _STRUTS),
        *on("rotor", *map(_blade, range(4))),
        *on("tail", *_TAIL_BLADES),
    )

    length_m: Length = 14.0
    """Length of the fuselage with its tail, m; the main rotor is 1.16 times that across."""
    temperature_k: Kelvin = 290.0
    """Temperature of the skin, kelvin."""
    engine_k: Kelvin = 460.0
    """Temperature of exhausts and rotor head, kelvin."""
    rotor_k: Kelvin = 283.0
    """Temperature of the blades, kelvin."""
    windows_k: Kelvin = 278.0
    """Temperature of the windows, kelvin."""
    windows_emissivity: Fraction = 0.85
    """Emissivity of the windows: glass in the thermal infrared."""
    rotor_hz: NotNegative = 4.3
    """Turns of the main rotor a second; the tail rotor turns five times as fast."""
    rotor_deg: Turn = 30.0
    """Angle of the main rotor in frame 0, degrees."""

    def joints(self, time: float) -> Mapping[str, Rigid]:
        turn = turned(self.rotor_deg, self.rotor_hz, time)
        return {"rotor": hinge(_MAST, (0.0, 0.0, 1.0), -turn), "tail": hinge(_TAIL, (0.0, 1.0, 0.0), 5 * turn)}

"""Quantities of scenarios: types with allowed and plausible ranges."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from irsim.config.base import invalid
from irsim.config.fields import Located, Plausible
from irsim.config.paths import absolute_name

LARGEST = 10_000_000
"""Largest number in a scene: sums of squares stay far within the range of floats."""

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
AboveZero = Annotated[float, Field(gt=0)]
"""Positive number without an upper limit."""
Positive = Annotated[float, Field(ge=1e-6, le=LARGEST)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Metres = Annotated[float, Field(ge=0.001, le=1_000_000)]
"""Size or distance: up to 1000 km, beyond any horizon on earth."""
Range = Annotated[Metres, Plausible(5, 100_000, "m")]
"""Distance from the camera: nearer than 5 m is out of focus, beyond 100 km lies behind the horizon."""
Length = Annotated[Metres, Plausible(0.05, 400, "m")]
"""Length of an object: from an insect to the longest ship."""
Height = Annotated[Metres, Plausible(0.3, 25_000, "m")]
"""Height of a camera above the ground or the sea: from a small robot to the highest aircraft."""
Feature = Annotated[Positive, Plausible(0.1, 3000, "mrad")]
"""Angular size of a feature on the ground or in the sky: from 2 m at 20 km to half a turn."""
TOP_SPEED = Plausible(-8000, 8000, "m/s")
"""Largest plausible speed, m/s: re-entry from orbit is the fastest motion in the air."""
Speed = Annotated[Number, TOP_SPEED]
TOP_PIXEL_SPEED = Plausible(0, 500, "px per frame")
PixelSpeed = Annotated[NotNegative, TOP_PIXEL_SPEED]
"""Speed in the picture, px per frame: a faster target leaves most pictures within a frame."""
Degrees = Annotated[Number, Plausible(-720, 720, "degrees")]
"""Direction, degrees: more than two turns are probably a mistake of unit."""
Turning = Annotated[Number, Plausible(-3600, 3600, "degrees/s")]
"""Rate of rotation, degrees a second: no gimbal and no aircraft makes more than ten turns a second."""
Velocity = Annotated[tuple[Speed, Speed, Speed], Field(strict=False)]
Area = Annotated[Positive, Plausible(1e-4, 5000, "m2")]
"""Projected area of an object: from an insect to a large ship."""
Kelvin = Annotated[float, Field(ge=1, le=6000), Plausible(150, 3500, "K", "degrees Celsius + 273.15")]
"""Scene temperature: from a clear night sky to burning magnesium."""
AirKelvin = Annotated[float, Field(ge=1, le=6000), Plausible(180, 335, "K", "degrees Celsius + 273.15")]
"""Air temperature on earth: 184 K (Vostok, 1983) to 330 K (Death Valley, 1913) have been measured."""
SCALE_K = (100, 6000)
"""Lowest and highest black-body temperature at an end of a scale of counts, K."""
ScaleKelvin = Annotated[float, Field(ge=SCALE_K[0], le=SCALE_K[1])]
"""Black-body temperature at an end of a scale of counts. Colder scenes radiate so little that neighbouring counts are
the same."""
KelvinSpread = Annotated[float, Field(ge=0, le=1000), Plausible(0, 300, "K")]
"""Standard deviation or excess of temperature: only fire reaches hundreds of kelvin."""
KelvinDifference = Annotated[float, Field(ge=-6000, le=6000)]
Pair = Annotated[tuple[Number, Number], Field(strict=False)]
Index = Annotated[int, Field(ge=0, le=LARGEST)]
"""Number of a frame."""
Stretch = Annotated[tuple[Index, Index], Field(strict=False)]
"""[first, last] frame, both included."""
Triple = Annotated[tuple[Number, Number, Number], Field(strict=False)]


def _risen(pair: tuple[float, float]) -> tuple[float, float]:
    least, most = pair
    if least > most:
        raise invalid(f"{least} is above {most}; allowed: the lesser first")
    return pair


Rising = AfterValidator(_risen)
"""Validator of a pair [least, greatest]: a pair in falling order is an error."""

FileName = Annotated[str, Located(), AfterValidator(absolute_name)]
"""Absolute name of a file, independent of the working directory."""

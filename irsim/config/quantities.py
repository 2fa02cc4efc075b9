"""Numbers that may stand in a scenario: what is allowed, and what is plausible."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from irsim.config.field_annotations import Plausible

LARGEST = 10_000_000
"""No number of a scene is larger, and squares of all of them stay far within what floats can hold."""

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
AboveZero = Annotated[float, Field(gt=0)]
"""Of what others measured: as small or large as it may be."""
Positive = Annotated[float, Field(ge=1e-6, le=LARGEST)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Metres = Annotated[float, Field(ge=0.001, le=1_000_000)]
"""A size or a range: up to 1000 km, beyond any horizon on earth."""
Range = Annotated[Metres, Plausible(5, 100_000, "m")]
"""How far away something is: nearer than 5 m it is out of focus, and beyond 100 km behind the horizon."""
Length = Annotated[Metres, Plausible(0.05, 400, "m")]
"""Of a thing: from an insect to the longest of ships."""
Height = Annotated[Metres, Plausible(0.3, 25_000, "m")]
"""Of a camera above the ground or the sea: from a small robot's to that of the highest aircraft that look down."""
Feature = Annotated[Positive, Plausible(0.1, 3000, "mrad")]
"""Size of something on the ground or in the sky as it is seen: from 2 m 20 km away to half of all around."""
TOP_SPEED = Plausible(-8000, 8000, "m/s")
"""Nothing in the air is faster than what comes back from orbit."""
Speed = Annotated[Number, TOP_SPEED]
TOP_PIXEL_SPEED = Plausible(0, 500, "px per frame")
PixelSpeed = Annotated[NotNegative, TOP_PIXEL_SPEED]
"""What is faster is gone from most pictures with the next frame."""
Degrees = Annotated[Number, Plausible(-720, 720, "degrees")]
"""Of a direction: more than twice around is some other number."""
Turning = Annotated[Number, Plausible(-3600, 3600, "degrees/s")]
"""Ten turns a second: no gimbal and nothing that flies turns faster as a whole."""
Velocity = Annotated[tuple[Speed, Speed, Speed], Field(strict=False)]
Area = Annotated[Positive, Plausible(1e-4, 5000, "m2")]
"""Projected, of a thing: from an insect to a large ship."""
Kelvin = Annotated[float, Field(ge=1, le=6000), Plausible(150, 3500, "K", "degrees Celsius + 273.15")]
"""Nothing that a thermal camera is pointed at is colder than a clear night sky or hotter than burning magnesium."""
AirKelvin = Annotated[float, Field(ge=1, le=6000), Plausible(180, 335, "K", "degrees Celsius + 273.15")]
"""Of the air on earth: 184 K (Vostok, 1983) to 330 K (Death Valley, 1913) have been measured."""
SCALE_K = (100, 6000)
"""The least and the greatest that an end of a scale may be, K."""
ScaleKelvin = Annotated[float, Field(ge=SCALE_K[0], le=SCALE_K[1])]
"""The end of a scale. Colder scenes send so little light that no count could be told from the next."""
KelvinSpread = Annotated[float, Field(ge=0, le=1000), Plausible(0, 300, "K")]
"""A standard deviation of temperature, or how much warmer something is: nothing but fire is by hundreds."""
KelvinDifference = Annotated[float, Field(ge=-6000, le=6000)]
Pair = Annotated[tuple[Number, Number], Field(strict=False)]
Index = Annotated[int, Field(ge=0, le=LARGEST)]
"""A frame's number."""
Stretch = Annotated[tuple[Index, Index], Field(strict=False)]
"""[first, last] frame, both counted."""
Triple = Annotated[tuple[Number, Number, Number], Field(strict=False)]


def _risen(pair: tuple[float, float]) -> tuple[float, float]:
    least, most = pair
    if least > most:
        raise PydanticCustomError(
            "falls", "{least} is above {most}; allowed: the lesser first", {"least": least, "most": most}
        )
    return pair


Rising = AfterValidator(_risen)
"""Beside a pair [least, greatest]: the wrong way round it is an error."""

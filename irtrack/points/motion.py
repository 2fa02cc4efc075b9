"""Banks of motion models for filters of points."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from irsim.config.base import Part
from irsim.config.quantities import Fraction
from irtrack.errors import InputError
from irtrack.filters.multiple_model import (
    STATE,
    Model,
    MultipleModel,
    constant_acceleration_model,
    coordinated_turn_model,
    singer_model,
    white_acceleration_model,
)

Positive = Annotated[float, Field(gt=0, le=1e4)]
ModelName = Literal["cv", "left", "right", "ca", "singer"]
TURNS: tuple[ModelName, ...] = ("cv", "left", "right")


class Motion(Part):
    """Settings of the motion models, shared by all filters in a comparison."""

    acceleration: Positive = 0.2
    """cv, left, right: root of the density of white acceleration, px/frame^(3/2)."""
    turn_rate: Annotated[float, Field(gt=1e-3, le=3)] = 0.1
    """left, right: turn rate, rad/frame."""
    increment: Positive = 0.2
    """ca: standard deviation of the increments of acceleration, px/frame^2."""
    manoeuvre: Positive = 0.5
    """singer: standard deviation of acceleration, px/frame^2."""
    decay: Annotated[float, Field(gt=1e-2, le=10)] = 0.2
    """singer: rate at which acceleration decays, 1/frame."""
    stay: Fraction = 0.9
    """Probability that a model stays in force for a frame."""

    def bank(self, names: tuple[ModelName, ...]) -> MultipleModel:
        """Return the bank of models: of four states (x, y, vx, vy), or of six where one has an acceleration."""
        if not names or not 0 < self.stay < 1:
            raise InputError(f"models {names}, stay {self.stay}; allowed: at least one model, 0 < stay < 1")
        size = STATE if {"ca", "singer"} & set(names) else 4
        return MultipleModel.of([self._model(name, size) for name in names], self.stay)

    def _model(self, name: ModelName, size: int) -> Model:
        if name == "ca":
            return constant_acceleration_model(self.increment)
        if name == "singer":
            return singer_model(self.manoeuvre, self.decay)
        straight = white_acceleration_model(self.acceleration, size)
        if name == "cv":
            return straight
        turn = coordinated_turn_model(self.turn_rate if name == "right" else -self.turn_rate, 0.0)
        return Model(np.ascontiguousarray(turn.F[:size, :size]), straight.Q)

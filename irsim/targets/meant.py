"""Words that people use for targets, each with the kind that they will have meant."""

from __future__ import annotations

from types import MappingProxyType

_WORDS = {
    "fighter": "jet warplane",
    "airliner": "plane airplane aeroplane aircraft jetliner",
    "helicopter": "helo heli chopper rotorcraft",
    "quadrotor": "quadcopter drone uav uas multirotor multicopter",
    "missile": "rocket sam",
    "bird": "gull goose duck pigeon",
    "tank": "apc ifv armour armor",
    "truck": "lorry bus van",
    "car": "vehicle automobile suv sedan",
    "boat": "ship vessel yacht frigate",
    "pedestrian": "person human man woman people walker soldier",
    "point": "dot blob point_source",
    "mesh": "obj stl model",
    "flare": "decoy",
}

MEANT = MappingProxyType({word: kind for kind, words in _WORDS.items() for word in words.split()})
"""Word -> kind, for an error to suggest: scenarios are not read by them."""

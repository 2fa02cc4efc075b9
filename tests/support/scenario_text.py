"""A scenario as text, for the tests of loading."""

from __future__ import annotations

import pytest

from irsim.errors import InputError
from irsim.scenario.loader import loads

TEXT = """\
about: a point crosses
seed: 7
frames: 1e1
camera:
  size: [64, 48]
  netd_mk: 60
  noise:
    - {kind: white}
    - {kind: ar1, id: flicker, rho: 0.9, ratio: 0.5}
  motion:
    - {kind: pan, azimuth_deg_s: 0.5}
background:
  kind: sky
  clouds:
    - {coverage: 0.3, wind_mrad_s: [1, 0]}
targets:
  - id: jet
    shape: {kind: point, temperature_k: 500}
    path: {kind: straight, start: [10, 20.5], speed: 2}
  - id: far
    shape: {kind: point}
    path: {kind: straight, start: [30, 10]}
occluders:
  - {kind: bar, range_m: 100, center_px: [40, 20], size_px: [6, 60]}
follow: jet
"""


def errors_of(text: str, *overrides: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        loads(text, "f.yaml", overrides)
    return str(caught.value).splitlines()

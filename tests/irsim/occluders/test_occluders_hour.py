"""Trees that hide are as warm as those of the background they stand before."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.geometry.pose import CameraPose
from irsim.occluders.tree import Tree
from irsim.physics.radiometry import temperature
from irsim.scenario.loader import loads


@pytest.mark.parametrize("background", ["ground", "landscape"])
@pytest.mark.parametrize(("hour", "leaves_k"), [("any", 290.0), ("day", 297.0), ("night", 285.5)])
def test_leaves_and_trunk_are_as_warm_as_the_hour_of_the_background_has_it(
    background: str, hour: str, leaves_k: float
) -> None:
    """The temperatures of a landscape's own trees; what is given stays."""

    def warmth(keys: str = "") -> tuple[float, float]:
        scenario = loads(
            f"background: {{kind: {background}, hour: {hour}}}\n"
            "targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 90]}}]\n"
            "occluders: [{kind: tree, id: oak, range_m: 90, foot_px: [60, 100], height_px: 80, crown_px: [50, 50], "
            f"spread_k: 0, emissivity: 1{keys}}}]\n"
        )
        (oak,) = scenario.occluders
        assert isinstance(oak, Tree)
        sprite = oak.draw(CameraPose.first(scenario.context))
        assert sprite is not None
        middle = np.unravel_index(int(np.argmax(sprite.alpha)), sprite.alpha.shape)
        seen = float(temperature(scenario.context.band, sprite.emission[middle] / sprite.alpha[middle]))
        assert seen == pytest.approx(oak.warmth(scenario.context)[0], abs=0.3)
        return oak.warmth(scenario.context)

    assert warmth() == (leaves_k, leaves_k + 1)
    assert warmth(", temperature_k: 280") == (280, leaves_k + 1)
    assert warmth(", trunk_k: 310") == (leaves_k, 310)

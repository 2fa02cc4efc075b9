"""A body's light as it turns and nears in small steps: parts hide each other with no jump, edge-on too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from test_shapes import AWAY, BODIES, IFOV, shape

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion.attitude import euler
from irsim.physics.radiometry import radiance
from irsim.targets import View
from irsim.targets.body import Body
from irsim.targets.parts import Solid, block
from irsim.targets.polyhedra import build_polyhedra
from irsim.targets.visibility import split_intersections
from irsim.types import Floats

NEARING = 0.01
JUMPS = {"bird": 0.01, "truck": 0.01, "boat": 0.01, "pedestrian": 0.01}
"""The light of a body jumps by no more, a share of it; that of the others by a thousandth."""
EMPTY = float(radiance("mwir", 200.0))
HEADINGS = (0.0, 30.0, 60.0, 90.0, 130.0, 180.0, 250.0, 335.0)


def light(value: Body, angles: tuple[float, float, float], px: float = 8.0, ifov: float = IFOV) -> float:
    """What it adds to a scene of 200 K, in units of its length's square."""
    where = SceneContext(0, Geometry((160, 120), ifov), 30.0, "mwir", 0.6)
    place = where.geometry.place(np.array([79.5, 59.5]), value.length_m / (px * ifov))
    sprite = value.draw(View(place, AWAY @ euler(np.array(angles)), where, 0.3))
    assert sprite is not None
    return float((sprite.emission - sprite.alpha * EMPTY).sum()) / (px * px)


def jump(value: Callable[[float], float], steps: Floats) -> float:
    """The largest relative step that is left of a function between places 0.0002 apart: the six widest of its steps
    are halved again and again, towards the half that changes more."""
    found = np.array([value(step) for step in steps.tolist()])
    left = []
    for widest in np.argsort(np.abs(np.diff(found)))[-6:].tolist():
        low, high = steps[widest : widest + 2].tolist()
        at_low, at_high = found[widest : widest + 2].tolist()
        while high - low > 2e-4:
            middle = (low + high) / 2
            at_middle = value(middle)
            if abs(at_middle - at_low) > abs(at_high - at_middle):
                high, at_high = middle, at_middle
            else:
                low, at_low = middle, at_middle
        left.append(abs(at_high - at_low) / at_low)
    return float(max(left))


def pitched(value: Body, heading: float) -> Callable[[float], float]:
    return lambda pitch: light(value, (heading, pitch, 0.0))


def body(kind: str) -> Body:
    value = shape(kind)
    assert isinstance(value, Body)
    return value


@pytest.mark.parametrize("kind", BODIES)
class TestEveryBody:
    def test_its_light_does_not_jump_as_it_pitches_through_level(self, kind: str) -> None:
        value = body(kind)
        for heading in HEADINGS:
            assert jump(pitched(value, heading), np.linspace(-3, 3, 41)) < JUMPS.get(kind, 0.001)

    @pytest.mark.sampled
    @pytest.mark.parametrize("pitch", [0.0, -3.0, 12.0, -20.0])
    def test_its_light_does_not_jump_as_it_yaws(self, kind: str, pitch: float) -> None:
        value = body(kind)
        assert jump(lambda heading: light(value, (heading, pitch, 0.0)), np.linspace(0, 360, 481)) < JUMPS.get(
            kind, 0.001
        )

    def test_a_speck_of_it_has_its_light(self, kind: str) -> None:
        """At attitudes at which edges of unlike parts fall onto each other: of hundredths of a pixel, too, which
        lies far from the picture's corner."""
        for angles in [(90.0, 30.0, 0.0), (270.0, -30.0, 0.0), *((heading, 0.0, 0.0) for heading in HEADINGS)]:
            near = light(body(kind), angles, 8.0, 1e-5)
            far = [light(body(kind), angles, px, 1e-5) for px in (0.02, 0.05, 0.1, 0.2, 0.5)]
            assert far == pytest.approx([near] * 5, rel=NEARING)

    @pytest.mark.parametrize("pitch", [0.0, 0.05, 2.0])
    def test_its_light_goes_with_the_square_of_its_range(self, kind: str, pitch: float) -> None:
        """From half a pixel to thirty, through a narrow lens: its near side does not grow before its far side."""
        for heading in HEADINGS:
            found = [light(body(kind), (heading, pitch, 0.0), px, 1e-5) for px in np.geomspace(0.5, 30.0, 10).tolist()]
            assert np.ptp(found) < NEARING * np.mean(found)


class TestParted:
    COLD = block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), "cold")

    def corners(self, solid: Solid) -> set[tuple[float, ...]]:
        return {tuple(np.round(point, 6).tolist()) for point in solid.points}

    def test_what_sinks_into_a_face_ends_there(self) -> None:
        sunk = block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5), "hot")
        cold, hot = sorted(split_intersections((self.COLD, sunk)), key=lambda solid: solid.heat)
        assert self.corners(cold) == self.corners(self.COLD)
        assert self.corners(hot) == self.corners(block((0.2, 0.2, -0.5), (0.6, 0.8, 0.0)))

    def test_what_runs_through_becomes_two(self) -> None:
        through = block((0.2, 0.2, -0.5), (0.6, 0.8, 1.5), "hot")
        pieces = [self.corners(solid) for solid in split_intersections((self.COLD, through)) if solid.heat == "hot"]
        wanted = [self.corners(block((0.2, 0.2, low), (0.6, 0.8, low + 0.5))) for low in (-0.5, 1.0)]
        assert sorted(map(sorted, pieces)) == sorted(map(sorted, wanted))

    @pytest.mark.parametrize("other", [block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5), "cold"), block((2, 0, 0), (3, 1, 1))])
    def test_what_shines_alike_or_lies_apart_stays(self, other: Solid) -> None:
        assert [self.corners(each) for each in split_intersections((self.COLD, other))] == [
            self.corners(each) for each in (self.COLD, other)
        ]

    def test_what_moves_otherwise_stays(self) -> None:
        arm = Solid(block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5)).points, "hot", "joint")
        assert [self.corners(each) for each in split_intersections((self.COLD, arm))] == [
            self.corners(self.COLD),
            self.corners(arm),
        ]

    @pytest.mark.parametrize("kind", BODIES)
    def test_a_body_has_hardly_more_parts_for_it(self, kind: str) -> None:
        whole, cut = (
            build_polyhedra(solids, 1.0).parts for solids in (body(kind).solids, split_intersections(body(kind).solids))
        )
        assert cut.count <= whole.count + 5
        assert len(cut.tail) < 1.4 * len(whole.tail)

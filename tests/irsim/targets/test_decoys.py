"""Flares, hot spots and like-grey neighbours."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irsim import loads
from irsim.lint import doubts
from irsim.render.frame import Renderer
from irsim.targets.flare import Flare

HEAD = """
frames: 150
camera: {size: [160, 120], netd_mk: 0, psf_px: 0.8}
background: {kind: sky, horizon_k: 250, zenith_k: 250}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [40, 40], speed: 0.6, range_m: 2500}}
"""


class TestFlare:
    def test_it_rises_burns_and_fades(self) -> None:
        flare = Flare(rise_s=0.2, burn_s=2.0, fade_s=0.5)
        assert flare.fire(0.2) == pytest.approx(1 - math.exp(-1))
        assert flare.fire(1.9) == pytest.approx(1, abs=1e-4)
        assert flare.fire(2.5) == pytest.approx(math.exp(-1), abs=1e-4)
        assert flare.fire(math.inf) == 1

    @pytest.mark.parametrize(("frame", "told"), [(149, False), (149.5, True), (500, True)])
    def test_a_throw_after_the_last_frame_is_warned_of(self, frame: float, told: bool) -> None:
        path = f"{{kind: thrown, target: jet, at_frame: {frame}}}"
        said = list(doubts(loads(HEAD + f"  - {{id: flare, shape: {{kind: flare}}, path: {path}}}\n")))
        assert [notice.at for notice in said] == [("targets", 1, "path")] * told
        assert all(f"begins at frame {frame:g}, after the last, 149" in notice.message for notice in said)

    def test_it_is_there_from_its_throw_until_it_is_burnt_out(self) -> None:
        text = HEAD + "  - {id: flare, shape: {kind: flare, burn_s: 1.0, fade_s: 0.1}, PATH}\n".replace(
            "PATH", "path: {kind: thrown, target: jet, at_frame: 20}"
        )
        renderer = Renderer(loads(text))
        there = {frame: renderer.scene(frame)[1].target("flare") for frame in (19, 20, 21, 40, 60, 90)}
        assert [frame for frame, target in there.items() if target is not None] == [21, 40, 60]
        young, old = there[21], there[60]
        assert young is not None
        assert old is not None
        assert young.cls == "decoy"
        # It falls: it is below where it was thrown, and behind the jet that flies on.
        assert old.center[1] > young.center[1] + 5
        jet = renderer.scene(60)[1].target("jet")
        assert jet is not None
        assert old.center[0] < jet.center[0]

    @pytest.mark.parametrize(
        ("shape", "first"), [("flare", 21), ("flare, rise_s: 0", 20), ("hot_spot", 20), ("bird", 20)]
    )
    def test_what_is_thrown_is_there_from_that_frame_on_but_a_flare_is_dark_in_it(self, shape: str, first: int) -> None:
        path = "{kind: thrown, target: jet, at_frame: 20}"
        renderer = Renderer(loads(HEAD + f"  - {{id: it, shape: {{kind: {shape}}}, path: {path}}}\n"))
        there = [frame for frame in range(18, 24) if renderer.scene(frame)[1].target("it") is not None]
        assert there == list(range(first, 24))

    def test_its_light_is_its_fire(self) -> None:
        text = HEAD + "  - {id: flare, shape: {kind: flare}, path: {kind: thrown, target: jet, at_frame: 20}}\n"
        flare, empty = (
            Renderer(loads(text, overrides=["without=[jet]"])),
            Renderer(loads(text, overrides=["without=[jet, flare]"])),
        )
        dark = empty.scene(0)[0]
        seen = [float((flare.scene(frame)[0].astype(float) - dark).sum()) for frame in (21, 50, 110)]
        shape = Flare()
        expected = [shape.fire((frame - 20) / 30) for frame in (21, 50, 110)]
        # Ranges differ by a few metres of 2,500.
        np.testing.assert_allclose(np.array(seen) / seen[1], np.array(expected) / expected[1], rtol=0.02)


def test_a_hot_spot_has_its_size() -> None:
    text = HEAD.replace("{kind: fighter}", "{kind: hot_spot, size_m: [10, 6]}")
    (spot,) = Renderer(loads(text)).scene(0)[1].targets
    # 10 m and 6 m at 2,500 m and 0.5 mrad.
    assert (spot.box.w, spot.box.h) == pytest.approx((8, 4.8), rel=1e-3)
    assert spot.cls == "decoy"


class TestNeighbour:
    TWIN = "  - {id: twin, cls: decoy, shape: {kind: fighter}, contrast: SHARE, PATH}\n".replace(
        "PATH", "path: {kind: follow, target: jet, offset_px: [40, 30]}"
    )

    @pytest.mark.parametrize("share", [0.0, 0.5, 1.5])
    def test_it_differs_from_what_is_behind_by_its_share(self, share: float) -> None:
        text = (HEAD + self.TWIN).replace("horizon_k: 250", "horizon_k: 250, clouds: [{}]")
        own, faint = (Renderer(loads(text.replace("SHARE", value))) for value in ("1.0", str(share)))
        none = Renderer(loads(text.replace("SHARE", "1.0"), overrides=["without=[twin]"])).scene(7)[0].astype(float)
        whole, less = own.scene(7)[0] - none, faint.scene(7)[0] - none
        np.testing.assert_allclose(less, share * whole, atol=1e-5 * abs(whole).max())

    def test_truth_says_its_contrast(self) -> None:
        renderer = Renderer(loads(HEAD + self.TWIN.replace("SHARE", "0.5")))
        jet, twin = renderer.scene(7)[1].targets
        assert jet.contrast_k is not None
        assert twin.contrast_k is not None
        assert 0.4 * jet.contrast_k < twin.contrast_k < 0.8 * jet.contrast_k
        assert twin.center == pytest.approx(np.add(jet.center, (40, 30)), abs=0.05)
        assert (twin.box.w, twin.box.h) == pytest.approx((jet.box.w, jet.box.h), rel=0.02)

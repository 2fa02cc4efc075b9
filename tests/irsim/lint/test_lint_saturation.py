"""Warnings about pixels and grey levels at the ends of their scale."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from lint_scenes import check_warning, warned

from irsim.physics.radiometry import radiance

FIXED = {"kind": "fixed", "low": 2000, "high": 6000}


def scene(background: dict[str, Any], range_k: tuple[float, float], **camera: Any) -> dict[str, Any]:
    return {"frames": 5, "camera": {"ifov_mrad": 1.0, "range_k": range_k, **camera}, "background": background}


@pytest.mark.parametrize(
    ("background", "range_k", "words"),
    [
        ({"kind": "ground", "mean_k": 330, "spread_k": 2}, (250, 310), "all of the ground, {} lies above"),
        ({"kind": "ground", "mean_k": 250, "spread_k": 1}, (270, 310), "all of the ground, {} lies below"),
        ({"kind": "ground", "mean_k": 310, "spread_k": 3}, (250, 310), None),
        ({"kind": "landscape", "ground_k": 330}, (200, 310), "all of the ground, {} lies above"),
        ({"kind": "landscape", "ground_k": 290}, (200, 310), None),
    ],
)
def test_saturated_ground(background: dict[str, Any], range_k: tuple[float, float], words: str | None) -> None:
    found = [each for each in warned(scene(background, range_k)).values() if each.startswith("all of the ")]
    assert len(found) == (words is not None)
    assert all(re.match((words or "").format(r"\d+ to \d+ K,"), message) for message in found)


def test_saturated_sky() -> None:
    """The picture covers 8.6 to 11.4 degrees: the sky is 245 + 45 exp(-sin / 0.3), 268.3 to 272.3 K."""
    sky, up = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}, {"elevation_deg": 10}
    above = "all of the clear sky, 268 to 272 K, lies above: its pixels are full; range_k: [220, 280] holds it"
    below = "all of the clear sky, 268 to 272 K, lies below: its pixels are at count 0; range_k: [260, 300] holds it"
    check_warning(scene(sky, (220, 268), **up), "camera.range_k", above)
    check_warning(scene(sky, (273, 300), **up), "camera.range_k", below)
    check_warning(scene(sky, (220, 271.9), **up), None)
    check_warning(scene(sky, (260, 300), **up), None)
    well = {"detector": {"kind": "electrons"}, "band": "lwir", **up}  # full after 10 ms
    messages = warned(scene(sky, (220, 400), **well)).values()
    assert any("lies above: its pixels are full; try a shorter integration_ms" in message for message in messages)


def test_sky_saturated_in_half_of_the_picture() -> None:
    """At 10 degrees, half the height of the picture, the sky has 270.2 K."""
    sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}
    message = warned(scene(sky, (270.2, 300), elevation_deg=10))["camera.range_k"]
    part, rest = message.split("% of the clear sky, 268 to 272 K, lies below, in ")
    assert rest == f"{part}% of the picture: its pixels are at count 0; range_k: [260, 300] holds it"
    assert 45 <= float(part) <= 55


def test_saturated_sun_glint() -> None:
    sun = {"kind": "sea", "camera_height_m": 20, "wind_m_s": 7, "sun_deg": (0, 20), "horizon_k": 285, "zenith_k": 230}

    def found(range_k: tuple[float, float] = (220, 400), **sea: Any) -> dict[str, str]:
        camera = {"size": (96, 72), "elevation_deg": -0.8, "netd_mk": 100}
        return warned(scene({**sun, **sea}, range_k, **camera))

    (message,) = found().values()
    match = re.match(r"(\d+)% of the sea, .* lies above, in (\d+)% of the picture: .* \[220, (\d+)\] holds", message)
    assert match is not None
    of_sea, of_picture, enough = map(int, match.groups())
    assert 20 <= of_picture <= of_sea < 100
    assert found((220, enough)) == found(sun_deg=None) == found(sun_deg=(170, 20)) == {}


@pytest.mark.parametrize(
    ("agc", "words"),
    [({"low": 9000}, "are all black; try less than "), ({"high": 2000}, "are all white; try more than "), ({}, None)],
)
def test_grey_scale_without_background(agc: dict[str, Any], words: str | None) -> None:
    """Counts are linear in radiance, from 220 to 400 K."""
    camera = {"band": "lwir", "agc": {"kind": "fixed", **agc}}
    found = warned({"camera": camera, "background": {"kind": "ground", "mean_k": 290, "spread_k": 1}})
    assert list(found) == [f"camera.agc.{key}" for key in agc]
    dark, ground, bright = radiance("lwir", np.array([220.0, 290.0, 400.0]))
    for message in found.values():
        match = re.search(r"the background's counts, (\d+) to (\d+), ", message)
        assert match is not None
        assert int(match[1]) < 16383 * (ground - dark) / (bright - dark) < int(match[2])
        assert f"{words}{match[2 if 'low' in agc else 1]}" in message


@pytest.mark.parametrize(
    ("agc", "bits", "key", "words"),
    [
        (FIXED, 10, "low", "counts of 10 bits are 0 to 1023: every picture is black; try less than 1023"),
        (FIXED, 12, "high", "counts of 12 bits are 0 to 4095: white is never reached; try 4095 at most"),
        (FIXED, 14, None, ""),
        ({"kind": "unsharp", "base": {"kind": "clahe", "base": FIXED}}, 10, "low", "counts of 10 bits are 0 to 1023"),
        ({"kind": "linear"}, 8, None, ""),
    ],
)
def test_grey_scale_beyond_the_counts(agc: dict[str, Any], bits: int, key: str | None, words: str) -> None:
    camera = {"bits": bits, "agc": agc, "range_k": (270, 310)}
    other = {"camera": camera, "background": {"kind": "ground"}}
    check_warning(other, key and f"camera.agc.{key}", words)


@pytest.mark.parametrize(
    ("agc", "place", "words"),
    [
        ({"kind": "clahe", "tiles": (64, 48)}, "tiles", "each tile of 1x1 px equalises its own noise"),
        ({"kind": "unsharp", "base": {"kind": "clahe", "tiles": (64, 48)}}, "base.tiles", "each tile of 1x1 px"),
        ({"kind": "clahe", "tiles": (64, 48), "clip_limit": 0}, None, ""),
        ({"kind": "clahe", "tiles": (16, 12)}, None, ""),
    ],
)
def test_small_clahe_tiles(agc: dict[str, Any], place: str | None, words: str) -> None:
    check_warning({"camera": {"band": "lwir", "agc": agc}}, place and f"camera.agc.{place}", words)

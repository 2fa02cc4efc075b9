"""Lenses, surroundings, greys and grounds that do not go with the rest of a scene."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from irsim.lint import doubts
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario


def told(scene: dict[str, Any]) -> dict[str, str]:
    """What is said, by the place that it is said of."""
    size = {"size": (64, 48), **scene.get("camera", {})}
    whole = {"background": {"kind": "sky", "horizon_k": 285.0, "zenith_k": 250.0}, **scene, "camera": size}
    return {
        ".".join(map(str, notice.at)): notice.message
        for notice in doubts(Scenario.model_validate({"frames": 31, **whole}))
    }


@pytest.mark.parametrize(
    ("camera", "aperture_m", "said"),
    [
        ({"preset": "cooled_mwir"}, 0.05, "the lens is 0.025 m wide"),
        ({"preset": "cooled_mwir"}, 0.025, None),
        ({"optics": {"f_number": 2, "pitch_um": 10}, "ifov_mrad": 0.1}, 0.02, "a focal length of 100 mm, at F/2"),
        ({"optics": {"f_number": 2, "pitch_um": 10}, "ifov_mrad": 0.1}, 0.05, None),
        ({}, 0.3, None),
    ],
)
def test_turbulence_seen_through_another_pupil_is_told(
    camera: dict[str, Any], aperture_m: float, said: str | None
) -> None:
    """Focal length is pitch over IFOV: 15 um / 0.15 mrad are the preset's 100 mm, of which F/4 leaves 25."""
    air = {"turbulence": {"cn2": 1e-14, "aperture_m": aperture_m}}
    lines = told({"camera": camera, "atmosphere": air})
    assert list(lines) == (["atmosphere.turbulence.aperture_m"] if said else [])
    assert all(said is not None and said in line for line in lines.values())
    assert told({"camera": camera, "atmosphere": {"turbulence": {"aperture_m": aperture_m}}}) == {}
    assert told({"camera": camera, "atmosphere": air, "without": ["turbulence"]}) == {}


@pytest.mark.parametrize(("elevation_deg", "said"), [(30, True), (0, False), (-30, False)])
@pytest.mark.parametrize("kind", ["ground", "landscape"])
def test_ground_that_fills_the_sky_is_told(elevation_deg: float, kind: str, said: bool) -> None:
    lines = told({"camera": {"elevation_deg": elevation_deg, "ifov_mrad": 0.5}, "background": {"kind": kind}})
    assert list(lines) == (["background"] if said and kind == "ground" else [])
    lowest = 30 - math.degrees(math.atan(23.5 * 0.5e-3))
    assert all(f"looks {lowest:.1f} degrees above the horizon" in line for line in lines.values())


def test_a_camera_that_turns_up_from_the_ground_is_told_when() -> None:
    """By a degree a frame from the horizon on; half of the picture is 0.7 degrees."""
    turned = {"elevation_deg": 0.0, "motion": [{"kind": "pan", "elevation_deg_s": 30.0}]}
    lines = told({"camera": turned, "background": {"kind": "ground"}})
    assert "at frame 30 the camera looks 29.3 degrees" in lines["background"]


CARRIED = {"motion": [{"kind": "platform", "velocity_m_s": (12.0, 0.0, 0.0)}]}
"""By 12 m in 31 frames."""


@pytest.mark.parametrize(
    ("background", "at", "said"),
    [
        ({"kind": "ground"}, "background", "car by some 24 px; try height_m, or a landscape"),
        ({"kind": "ground", "height_m": 100}, None, ""),
        ({"kind": "landscape"}, None, ""),
        ({"kind": "sea"}, None, ""),
        ({"kind": "sky", "clouds": [{"range_m": 3000}]}, None, ""),
    ],
)
def test_what_does_not_pass_by_a_carried_camera_is_told(background: dict[str, Any], at: str | None, said: str) -> None:
    """12 m are 24 px at 1000 m and 0.5 mrad."""
    path = {"kind": "straight", "start": (40, 40), "range_m": 1000}
    car = {"id": "car", "shape": {"kind": "point", "area_m2": 3}, "path": path}
    scene = {"camera": CARRIED, "background": background, "targets": [car]}
    lines = {place: what for place, what in told(scene).items() if "the camera is carried by 12 m" in what}
    assert list(lines) == ([at] if at else [])
    assert all(said in what for what in lines.values())
    assert not any("carried" in what for what in told({**scene, "without": ["platform"]}).values())


@pytest.mark.parametrize("kind", ["sky", "landscape", "sea"])
def test_clouds_that_a_carried_camera_goes_through_are_told(kind: str) -> None:
    """By 0.4 m a frame: at frame 26 it has gone 10.4 m."""
    clouds = [{"id": "far", "range_m": 13}, {"id": "near", "range_m": 10.2}]
    lines = told({"camera": CARRIED, "background": {"kind": kind, "clouds": clouds}})
    assert {at: what for at, what in lines.items() if "carried" in what} == {
        "background.clouds.0.range_m": "at frame 17 the camera has been carried by 6.5 m: far is painted as its first "
        "place sees it, and is ever more drawn out, or coarse, from there on",
        "background.clouds.1.range_m": "at frame 26 the camera has been carried by 10.2 m: it has gone through near, "
        "which is not drawn any more",
    }


def test_clouds_that_stay_farther_than_a_camera_is_carried_twice_are_not_told() -> None:
    """It is carried by 12 m in 30 frames."""
    clouds = [{"id": "far", "range_m": 24.1}]
    assert not any(
        "carried" in what
        for what in told({"camera": CARRIED, "background": {"kind": "sky", "clouds": clouds}}).values()
    )


@pytest.mark.parametrize("key", ["trees", "buildings"])
@pytest.mark.parametrize(("velocity", "through"), [((0.0, 12.0, 0.0), True), ((0.0, 0.0, -12.0), False)])
def test_rows_that_a_carried_camera_goes_through_are_told(
    key: str, velocity: tuple[float, float, float], through: bool
) -> None:
    """By 12 m north, or as far down, where a row 10.2 m away is still all around; it looks down from the first."""
    camera = {"motion": [{"kind": "platform", "velocity_m_s": velocity}], "elevation_deg": -60.0}
    background = {"kind": "landscape", "camera_height_m": 40.0, key: [{"id": "row", "range_m": 10.2}]}
    lines = told({"camera": camera, "background": background})
    assert (f"background.{key}.0.range_m" in lines) == through


@pytest.mark.parametrize(
    ("elevation_deg", "said"),
    [(0.0, "0.7 degrees above the horizon; from 2.9"), (-3.0, "2.3 degrees below the horizon"), (-4.0, None)],
)
def test_ground_of_a_height_that_is_seen_up_to_the_horizon_is_told(elevation_deg: float, said: str | None) -> None:
    """Half of the picture is 0.67 degrees; the plane ends 2.87 degrees below the level."""
    camera = {"elevation_deg": elevation_deg, "ifov_mrad": 0.5}
    lines = told({"camera": camera, "background": {"kind": "ground", "height_m": 50}})
    assert list(lines) == (["background.height_m"] if said else [])
    assert all(said is not None and said in line for line in lines.values())
    assert not told({"camera": camera, "background": {"kind": "ground"}})


def test_ground_that_fills_the_sky_is_told_once() -> None:
    """A picture that is all above the horizon is above the end of the plane, too."""
    for height in ({}, {"height_m": 50}):
        background = {"kind": "ground", **height}
        lines = told({"camera": {"elevation_deg": 4.0, "ifov_mrad": 0.5}, "background": background})
        assert list(lines) == ["background"]
        assert "looks 3.3 degrees above the horizon" in lines["background"]


def test_ground_of_a_height_has_a_true_map_down_to_the_nadir() -> None:
    camera = {"elevation_deg": -79.0, "ifov_mrad": 0.5}
    assert "nadir" in told({"camera": camera, "background": {"kind": "ground"}})["camera.elevation_deg"]
    assert not told({"camera": camera, "background": {"kind": "ground", "height_m": 50}})


def test_without_a_target_the_ground_is_told_from_a_metre_on() -> None:
    for speed, said in ((12.0, ["background"]), (0.9, [])):
        motion = [{"kind": "platform", "velocity_m_s": (speed, 0.0, 0.0)}]
        assert list(told({"camera": {"motion": motion}, "background": {"kind": "ground"}})) == said


@pytest.mark.parametrize(
    ("agc", "said"),
    [
        ({"low": 9000}, "are all black; try less than "),
        ({"high": 2000}, "are all white; try more than "),
        ({"low": 3000, "high": 9000}, None),
        ({}, None),
    ],
)
def test_greys_that_show_nothing_of_the_background_are_told(agc: dict[str, Any], said: str | None) -> None:
    """Counts are linear in radiance, from 220 to 400 K."""
    camera = {"band": "lwir", "agc": {"kind": "fixed", **agc}}
    lines = told({"camera": camera, "background": {"kind": "ground", "mean_k": 290, "spread_k": 1}})
    assert list(lines) == ([f"camera.agc.{next(iter(agc))}"] if said else [])
    dark, ground, bright = radiance("lwir", np.array([220.0, 290.0, 400.0]))
    for what in lines.values():
        found = re.search(r"the background's counts, (\d+) to (\d+), ", what)
        assert found is not None
        assert said is not None
        assert int(found[1]) < 16383 * (ground - dark) / (bright - dark) < int(found[2])
        assert said + found[2 if "low" in agc else 1] in what


def test_a_background_at_the_ends_of_the_counts_is_not_blamed_on_the_greys() -> None:
    camera = {"band": "lwir", "range_k": (300, 400), "agc": {"kind": "fixed"}}
    lines = told({"camera": camera, "background": {"kind": "ground", "mean_k": 280, "spread_k": 1}})
    assert list(lines) == ["camera.range_k"]


@pytest.mark.parametrize(
    ("background", "key", "said"),
    [
        (
            {"kind": "ground", "roads": {"contrast_k": -500}},
            "roads.contrast_k",
            "-500 K from ground of 290 K is -210 K",
        ),
        ({"kind": "ground", "mean_k": 280, "water": {"contrast_k": -278}}, "water.contrast_k", "is 2 K, colder than"),
        ({"kind": "ground", "fields": {"lane_k": -6000}}, "fields.lane_k", "is -5710 K"),
        ({"kind": "ground", "clutter": {"contrast_k": (3, 400)}}, "clutter.contrast_k", "is -110 K"),
        ({"kind": "landscape", "hour": "day", "roads": {"contrast_k": -302}}, "roads.contrast_k", "of 303 K is 1 K"),
        ({"kind": "landscape", "buildings": [{"roof_k": -5000}]}, "buildings.0.roof_k", "from walls of 290 K"),
        ({"kind": "landscape", "buildings": [{"windows_k": -225}]}, "buildings.0.windows_k", "is -2.5 K"),
    ],
)
def test_what_a_difference_makes_colder_than_space_is_told(background: dict[str, Any], key: str, said: str) -> None:
    lines = told({"background": background})
    assert list(lines) == [f"background.{key}"]
    assert said in lines[f"background.{key}"]
    assert told({"background": background, "without": [key.partition(".")[0]]}) == {}


@pytest.mark.parametrize(
    "background",
    [
        {"kind": "ground", "roads": {"contrast_k": -287}, "water": {"contrast_k": 500}},
        {"kind": "ground", "clutter": {"contrast_k": (3, 400), "cold": 0}},
        {"kind": "landscape", "buildings": [{"roof_k": -287, "windows_k": -220}]},
    ],
)
def test_what_is_warmer_than_space_is_not(background: dict[str, Any]) -> None:
    assert told({"background": background}) == {}


@pytest.mark.parametrize(
    ("agc", "at", "said"),
    [
        ({"kind": "clahe", "tiles": (64, 48)}, "tiles", "each tile of 1x1 px equalises its own noise"),
        ({"kind": "clahe", "tiles": (20, 16)}, "tiles", "fewer tiles than 20x16 in 64x48 px"),
        ({"kind": "unsharp", "base": {"kind": "clahe", "tiles": (64, 48)}}, "base.tiles", "each tile of 1x1 px"),
        ({"kind": "clahe", "tiles": (64, 48), "clip_limit": 0}, None, ""),
        ({"kind": "clahe", "tiles": (16, 12)}, None, ""),
        ({"kind": "unsharp"}, None, ""),
    ],
)
def test_tiles_of_hardly_any_pixels_are_told(agc: dict[str, Any], at: str | None, said: str) -> None:
    lines = told({"camera": {"band": "lwir", "agc": agc}})
    assert list(lines) == ([f"camera.agc.{at}"] if at else [])
    assert all(said in line for line in lines.values())


@pytest.mark.parametrize(
    ("kind", "key", "hz", "still"),
    [
        ("quadrotor", "rotor_hz", 90.0, True),
        ("quadrotor", "rotor_hz", 45.0, True),  # half turns on are as before
        ("quadrotor", "rotor_hz", 87.0, False),
        ("quadrotor", "rotor_hz", 0.0, False),  # so asked
        ("helicopter", "rotor_hz", 7.5, True),
        ("helicopter", "rotor_hz", 4.3, False),
        ("bird", "beat_hz", 30.0, True),
        ("bird", "beat_hz", 3.0, False),
    ],
)
def test_what_turns_from_like_to_like_is_told(kind: str, key: str, hz: float, still: bool) -> None:
    path = {"kind": "straight", "start": (30, 20), "speed": 0, "heading_deg": 20, "range_m": 200}
    scene = Scenario.model_validate(
        {
            "frames": 31,
            "camera": {"size": (64, 48), "rate_hz": 30},
            "background": {"kind": "sky", "horizon_k": 285.0, "zenith_k": 250.0},
            "targets": [{"id": "it", "shape": {"kind": kind, key: hz}, "path": path}],
        }
    )
    said = [notice for notice in doubts(scene) if notice.at == ("targets", 0, "shape", key)]
    assert len(said) == still
    first, *others = (Renderer(scene).drawn_targets(index)[0].piece.sprite.alpha for index in (0, 1, 2, 7))
    same = all(first.shape == other.shape and np.allclose(first, other, atol=1e-9) for other in others)
    assert same == (still or hz == 0)


@pytest.mark.parametrize(
    ("hz", "frames", "said"), [(87.0, 1, 0), (87.0, 2, 0), (90.0, 1, 0), (90.0, 2, 1), (1.0, 31, 0)]
)
def test_few_frames_and_slow_turns_are_not_taken_for_still(hz: float, frames: int, said: int) -> None:
    path = {"kind": "straight", "start": (30, 20), "speed": 0, "range_m": 200}
    target = {"id": "it", "shape": {"kind": "quadrotor", "rotor_hz": hz}, "path": path}
    notices = told({"frames": frames, "camera": {"rate_hz": 30}, "targets": [target]})
    assert sum(place.endswith("rotor_hz") for place in notices) == said


HIDDEN = "of them lie on each place in the mean and hide the ground"


@pytest.mark.parametrize(
    ("kind", "clutter", "ifov_mrad", "said"),
    [
        ("ground", {"per_mrad2": 0.6}, 0.4, None),
        ("ground", {"per_mrad2": 10, "size_mrad": [0.1, 0.3]}, 0.02, None),
        ("ground", {"per_mrad2": 1}, 0.4, f"4.1 {HIDDEN}; try 0.73 at most"),
        ("ground", {"per_mrad2": 0.01}, 20, "there are 4200000 of them, which take long to draw; try 0.0012 at most"),
        (
            "ground",
            {"per_mrad2": 10},
            0.4,
            f"41 {HIDDEN} and there are 1700000 of them, which take long to draw; try 0.73 at most",
        ),
        ("landscape", {"per_mrad2": 0.01}, 20, None),
        ("landscape", {"per_mrad2": 10}, 0.4, f"41 {HIDDEN}; try 0.73 at most"),
    ],
)
def test_too_much_clutter_is_told(kind: str, clutter: dict[str, Any], ifov_mrad: float, said: str | None) -> None:
    """The map of a ground is 1024 px wide and high; a landscape has far fewer things."""
    background = {"kind": kind, "clutter": clutter}
    scene = {"camera": {"ifov_mrad": ifov_mrad, "elevation_deg": -5.0}, "background": background}
    assert told(scene).get("background.clutter.per_mrad2") == said
    assert "background.clutter.per_mrad2" not in told({**scene, "without": ["clutter"]})


def test_buildings_of_too_many_windows_are_told() -> None:
    """2048 px of 2.5 px to the metre, and so many windows to each building."""
    row = {"range_m": 1000.0, "spacing_m": 0.5, "width_m": [28, 28], "height_m": [30, 30]}
    camera = {"ifov_mrad": 0.4, "elevation_deg": -1.0}

    def line(**changes: Any) -> str | None:
        background = {"kind": "landscape", "buildings": [{}, {"id": "many", **row, **changes}]}
        return told({"camera": camera, "background": background}).get("background.buildings.1")

    assert line() is None
    assert line(height_m=[200, 200], width_m=[60, 60]) == (
        "its 2300000 windows take long to draw; try a larger spacing_m, or lower or narrower ones"
    )

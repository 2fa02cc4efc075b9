"""Warnings about implausible numbers, keys without effect, and unreachable contrast."""

from __future__ import annotations

from typing import Any

import pytest
from lint_scenes import check_warning, point, warned

from irsim.config import yaml_text
from irsim.config.schema import Slot
from irsim.lint.values import implausible_values
from irsim.scenario.catalog import examples
from irsim.scenario.model import Scenario


@pytest.mark.parametrize(
    ("text", "warned"),
    [
        ("targets: [{shape: {kind: point, temperature_k: 149, area_m2: 3e4}}]", ["temperature_k", "area_m2"]),
        ("targets: [{path: {kind: straight, start: [9, 9], speed: 1e6, range_m: 1}}]", ["speed", "range_m"]),
        ("targets: [{path: {kind: straight_m, start_m: [0, 900, 0], velocity_m_s: [0, -9000, 0]}}]", [1]),
        ("camera: {psf_px: 5, rate_hz: 2000}", []),
        ("camera: {psf_px: 5.1, rate_hz: 2001}", ["psf_px", "rate_hz"]),
        ("camera: {motion: [{kind: pan, azimuth_deg_s: 1e6, elevation_deg_s: -90}]}", ["azimuth_deg_s"]),
        ("atmosphere: {temperature_k: 15}", ["temperature_k"]),
        ("background: {kind: sky, clouds: [{wind_mrad_s: [3, -1e6], sunlit_k: 900}]}", [1, "sunlit_k"]),
        ("background: {kind: landscape, buildings: [{height_m: [3, 9000]}]}", [1]),
    ],
)
def test_implausible_values(text: str, warned: list[str | int]) -> None:
    document = yaml_text.parse_yaml(text)
    assert [notice.at[-1] for notice in implausible_values(Slot.of(Scenario), document.value)] == warned


def test_shipped_values_are_plausible() -> None:
    for name, path in examples().items():
        assert not list(implausible_values(Slot.of(Scenario), yaml_text.read_yaml(path).value)), name


MWIR, LWIR, ELECTRONS = {"preset": "cooled_mwir"}, {"preset": "uncooled_lwir"}, {"detector": {"kind": "electrons"}}


@pytest.mark.parametrize(
    ("camera", "more", "place"),
    [
        ({"netd_mk": 100, **ELECTRONS}, {}, "camera.netd_mk"),
        ({**MWIR, "netd_mk": 100}, {}, "camera.netd_mk"),
        ({"range_k": (250, 300), **ELECTRONS}, {}, "camera.range_k"),
        ({**LWIR, **ELECTRONS}, {}, None),
        ({**LWIR, "netd_mk": 100}, {}, None),
        ({}, {"atmosphere": {"visibility_km": 8}}, "atmosphere.visibility_km"),
        ({}, {"atmosphere": {"visibility_km": 8, "preset": "tropical"}}, None),
    ],
)
def test_keys_without_effect(camera: dict[str, Any], more: dict[str, Any], place: str | None) -> None:
    found = warned({"camera": camera, "background": {"kind": "ground"}, **more})
    assert [each for each, message in found.items() if "does not count" in message] == (
        [] if place is None else [place]
    )


@pytest.mark.parametrize(
    ("background", "shape", "path", "place"),
    [
        ({}, {"scr": 5, "temperature_k": 400}, {}, "targets.0.shape.temperature_k"),
        ({}, {"contrast_k": None, "temperature_k": 400}, {}, None),
        ({"beta": 2, "betas": (2, 3)}, {}, {}, "background.beta"),
        ({"kind": "sky", "clouds": [{"beta": 2, "betas": (2, 3)}]}, {}, {}, "background.clouds.0.beta"),
        ({}, {}, {"ground_m": 50, "range_m": 900}, "targets.0.path.range_m"),
    ],
)
def test_overruled_keys(
    background: dict[str, Any], shape: dict[str, Any], path: dict[str, Any], place: str | None
) -> None:
    target = {**point(**path), "shape": {"kind": "point", **shape}}
    scene = {"camera": {"elevation_deg": -5}, "background": {"kind": "ground", **background}, "targets": [target]}
    found = [each for each, message in warned(scene).items() if "does not count beside" in message]
    assert found == ([] if place is None else [place])


@pytest.mark.parametrize(
    ("keys", "smoke"),
    [
        ({"hides": "it", "frames": (10, 12), "fraction": 0.5, "opacity": 0.3}, ["opacity"]),
        ({"hides": "it", "frames": (10, 12), "begins_frame": 3, "lasts_frames": 4}, ["begins_frame", "lasts_frames"]),
        ({"center_px": (32, 24), "size_px": (30, 20), "opacity": 0.3, "begins_frame": 3, "lasts_frames": 4}, []),
    ],
)
def test_smoke_keys_overruled_by_placement(keys: dict[str, Any], smoke: list[str]) -> None:
    occluder = {"kind": "smoke", "range_m": 500, **keys}
    found = warned({"background": {"kind": "ground"}, "targets": [point(speed=1)], "occluders": [occluder]})
    overruled = [place for place, message in found.items() if "does not count beside hides" in message]
    assert overruled == [f"occluders.0.{key}" for key in smoke]


def points(shape: dict[str, Any], camera: dict[str, Any], ground_k: float = 290, **scene: Any) -> dict[str, Any]:
    """Return a scenario with a point near the corner, where a lens may darken."""
    path = {"kind": "straight", "start": (4, 4), "speed": 0, "range_m": 1500}
    target = {"id": "it", "shape": {"kind": "point", **shape}, "path": path}
    ground = {"kind": "ground", "mean_k": ground_k, "spread_k": 0.1}
    whole = {"size": (96, 96), "bits": 16, **camera}
    return {"frames": 9, "camera": whole, "background": ground, "targets": [target], **scene}


@pytest.mark.parametrize(
    ("shape", "camera", "words"),
    [
        ({"area_m2": 0.05, "scr": -60}, {}, "it requires an SCR of -60: at frame 0 -"),
        ({"area_m2": 30, "scr": -60}, {}, None),
        ({"area_m2": 0.05, "scr": 60}, {}, None),
        ({"area_m2": 0.05, "scr": 60}, {"range_k": (285, 295)}, "as pixels are full"),
        ({"area_m2": 0.05, "contrast_k": -320}, {}, "is the limit, a point without any radiance"),
        ({"area_m2": 30, "contrast_k": 200}, {}, "it requires 200 K: at frame 0 "),
        ({"area_m2": 30, "contrast_k": -200, "flicker": {"kind": "blink"}}, {}, None),
    ],
)
def test_unreachable_contrast(shape: dict[str, Any], camera: dict[str, Any], words: str | None) -> None:
    key = "scr" if "scr" in shape else "contrast_k"
    check_warning(points(shape, camera), words and f"targets.0.shape.{key}", words or "")
    assert warned(points(shape, camera, without=["it"])) == {}


@pytest.mark.parametrize(
    ("camera", "ground_k", "contrast_k", "words"),
    [
        ({"range_k": (280, 310)}, 250, 5, "0% of that is left, as pixels are at count 0"),
        ({"range_k": (280, 310)}, 330, -10, "0% of that is left, as pixels are full"),
        ({"range_k": (220, 310), "falloff": {"vignetting": 0.5}}, 300, 20, None),
        ({"range_k": (220, 310)}, 300, 20, "as pixels are full"),
        ({"range_k": (280, 310), "falloff": {"vignetting": 0.5}}, 295, -5, "as pixels are at count 0"),
    ],
)
def test_contrast_cut_off(camera: dict[str, Any], ground_k: float, contrast_k: float, words: str | None) -> None:
    found = warned(points({"area_m2": 30, "contrast_k": contrast_k}, camera, ground_k))
    message = found.get("targets.0.shape.contrast_k")
    assert (message is not None) == (words is not None)
    assert message is None or (words or "") in message


@pytest.mark.parametrize(("camera", "invisible"), [({"netd_mk": 0}, True), ({"noise": []}, True), ({}, False)])
def test_scr_without_noise_and_clutter(camera: dict[str, Any], invisible: bool) -> None:
    scene = points({"scr": 9}, camera) | {"background": {"kind": "ground", "spread_k": 0}}
    check_warning(
        scene, "targets.0.shape.scr" if invisible else None, "it is invisible, with neither noise nor clutter"
    )

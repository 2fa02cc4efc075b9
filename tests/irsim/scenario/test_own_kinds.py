"""A user's background and detector, derived from the base classes, have all that irsim's own have."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from command_line import IRSIM
from pydantic import ValidationError

import irsim
from irsim.backgrounds import Background, ClearLayer, Ground, GroundRadiance, Layer, Sky
from irsim.camera.response import Response
from irsim.camera.sensor import NetdSensor, Sensor, SensorSettings
from irsim.geometry.context import SceneContext
from irsim.lint import lint
from irsim.lint.occluders import placed_occluder_excessive
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import Floats


class Lake(Background):
    """Water of one temperature, 20 m below the camera, under a sky of a model atmosphere."""

    surface: ClassVar[str] = "lake"

    water_k: float = 285.0

    @property
    def surface_m(self) -> float:
        return 20.0

    @property
    def sky_preset(self) -> str:
        return "us_standard"

    def clear(self, context: SceneContext) -> ClearLayer:
        return Sky(preset="us_standard").clear(context)

    def ground_radiance(self, context: SceneContext) -> GroundRadiance:
        land = Ground(mean_k=self.water_k, spread_k=0).ground_radiance(context)
        return lambda view_direction: land(view_direction)[:100]

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        return [self.clear(context)]


class Still(Background):
    """Image of a camera: count 100 everywhere; targets add 1 count for each W/m2/sr."""

    has_noise: ClassVar[bool] = True
    mapped: ClassVar[bool] = False

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        return [Picture()]


class Picture:
    name = "picture"
    range_m = np.inf

    def light(self, view_direction: Any) -> tuple[None, Floats]:
        return None, np.full((48, 64), 10.0, np.float32)

    def insert_into(self, light: Floats, index: int, uncovered: Floats) -> Floats:
        return np.asarray(100 + (light - 10))


class Integrating(Sensor):
    """Electron-counting sensor with its own integration time and no keys of the camera."""

    default_noise = ({"kind": "shot"},)
    camera_keys = ()
    counts_electrons = True
    integration_key = "gate_ms"

    gate_ms: float = 5.0

    def response(self, setting: SensorSettings) -> Response:
        return Response(1e5, 0.0, 0.0, 1e6, 500.0, 30.0, 100.0, 0.0, 2**setting.bits - 1, True, 10.0)


def scene(background: str, **changes: Any) -> dict[str, Any]:
    camera = {"size": (64, 48), **changes.pop("camera", {})}
    kind = background if background.islower() else f"{__name__}:{background}"
    return {"frames": 60, "camera": camera, "background": {"kind": kind, **changes.pop("keys", {})}, **changes}


def messages(value: dict[str, Any]) -> list[str]:
    return [notice.message for notice in lint(Scenario.model_validate(value))]


def sinking(down_m_s: float) -> dict[str, Any]:
    return {"motion": [{"kind": "platform", "velocity_m_s": (0.0, 0.0, -down_m_s)}]}


def test_the_linter_knows_its_surface_and_sky() -> None:
    assert any("reaches the lake, 20 m below" in text for text in messages(scene("Lake", camera=sinking(15.0))))
    assert not any("come down" in text for text in messages(scene("Lake", camera=sinking(5.0))))
    path = {"kind": "straight_m", "axes": "world", "start_m": (0.0, 900.0, -50.0)}
    target = {"id": "jet", "shape": {"kind": "fighter"}, "path": path}
    assert any("jet goes below the lake, 20 m under" in text for text in messages(scene("Lake", targets=[target])))
    hot = scene("Lake", camera={"range_k": (270.0, 310.0)}, keys={"water_k": 600.0})
    assert any(text.startswith("all of the lake, ") and "lies above" in text for text in messages(hot))
    cold_sky = scene("Lake", camera={"range_k": (400.0, 500.0), "elevation_deg": 10})
    assert any(text.startswith("all of the clear sky") for text in messages(cold_sky))
    tropical = scene("Lake", atmosphere={"preset": "tropical"})
    assert any("the sky is of us_standard behind an atmosphere of tropical" in text for text in messages(tropical))


def test_its_preset_needs_a_fitted_band() -> None:
    with pytest.raises(ValidationError, match="no atmosphere is fitted to a band"):
        Scenario.model_validate(scene("Lake", camera={"band": (5.5, 7.0)}))


def test_an_occluder_stands_below_its_horizon() -> None:
    """A pole that hides a target in the sky goes down to the horizon, and so hides one that dives for far longer."""
    target = {"id": "jet", "shape": {"kind": "point"}, "path": {"kind": "straight", "start": (32, 4), "speed": 0.5}}
    target["path"] |= {"heading_deg": 90.0, "range_m": 2000}  # type: ignore[operator]  # the dump of a path, a mapping
    pole = {"kind": "pole", "range_m": 500, "hides": "jet", "frames": (2, 4)}
    for background, expected in (("Lake", 1), ("sky", 1), ("ground", 0)):
        value = scene(background, camera={"elevation_deg": 3}, targets=[target], occluders=[pole])
        assert len(list(placed_occluder_excessive(Scenario.model_validate(value)))) == expected


def test_a_background_of_counts_takes_targets() -> None:
    up = {"motion": [{"kind": "pan", "elevation_deg_s": 45.0}]}
    assert any("zenith" in text for text in messages(scene("Lake", camera=up)))
    assert not any("zenith" in text for text in messages(scene("Still", camera=up)))
    target = {
        "id": "hot",
        "shape": {"kind": "point", "temperature_k": 900.0, "area_m2": 2.0},
        "path": {"kind": "straight"},
    }
    target["path"] |= {"start": (30, 20), "range_m": 100}  # type: ignore[operator]  # the dump of a path, a mapping
    rendered = Scenario.model_validate(scene("Still", targets=[target]))
    image = Renderer(rendered).frame(0)[0].image
    assert image[0, 0] == 100
    assert image[20, 30] > 100
    moments = irsim.Moments(rendered)
    np.testing.assert_allclose(moments.contribution(0, "hot"), image.astype(float) - 100, rtol=1e-5, atol=0.5)
    with pytest.raises(irsim.InputError, match="the noise of a recording is not known"):
        moments.mean(0)


def test_an_own_detector_has_its_keys_and_exposure() -> None:
    kind = {"kind": f"{__name__}:Integrating"}
    camera = {"detector": kind, "range_k": (270, 310), "smear": {}, "noise": [{"kind": "shot"}]}
    found = Scenario.model_validate(scene("ground", camera=camera))
    assert found.camera.exposure_ms == 5.0
    ignored = [notice.at[-1] for notice in lint(found) if "does not count for a detector of kind" in notice.message]
    assert ignored == ["range_k"]
    other = scene("ground", camera={**camera, "smear": {"time_ms": 2.0}})
    assert "2 ms of motion blur, but the detector integrates for 5 ms" in messages(other)
    with pytest.raises(ValidationError, match="do not fit into a frame"):
        Scenario.model_validate(scene("ground", camera={"detector": {**kind, "gate_ms": 50.0}}))
    off = scene("ground", camera={"detector": kind}, keys={"mean_k": 400.0})
    (place,) = [notice.at for notice in lint(Scenario.model_validate(off)) if "above: its pixels" in notice.message]
    assert place == ("camera", "detector", "gate_ms")


def test_a_bare_family_has_defaults() -> None:
    class Plain(Background):
        def layers(self, context: SceneContext) -> Sequence[Layer]:
            return Ground().layers(context)

    value = Scenario.model_validate(scene("ground", camera=sinking(50.0)))
    plain = value.model_copy(update={"background": Plain()})
    assert [notice.message for notice in lint(plain)] == []
    assert plain.sky_preset is None
    assert Sensor.camera_keys == NetdSensor.camera_keys
    assert NetdSensor().integration_time_ms is None


@pytest.mark.parametrize(
    "code", ["import sys\nsys.exit(0)", "import os\nos._exit(0)", "from os import _exit\n_exit(0)"]
)
def test_a_module_that_ends_the_program_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    (tmp_path / "ends_it.py").write_text(code)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(irsim.InputError, match="cannot import 'ends_it:Lake': it ends the program"):
        irsim.loads("background: {kind: 'ends_it:Lake'}")


def test_an_abstract_kind_is_an_error() -> None:
    with pytest.raises(irsim.InputError, match=r"'irsim\.backgrounds\.base:Background' is abstract; allowed: a class"):
        irsim.loads("background: {kind: 'irsim.backgrounds.base:Background'}")


RAISES = "from irsim.targets.point import Point\nclass Bad(Point):\n    def draw(self, view):\n        return 1 / 0\n"


def test_an_error_of_a_kind_is_told_in_its_own_lines(tmp_path: Path) -> None:
    (tmp_path / "bad_kind.py").write_text(RAISES)
    (tmp_path / "s.yaml").write_text(
        "frames: 2\nbackground: {kind: sky}\ntargets:\n"
        "- {id: a, shape: {kind: 'bad_kind:Bad', area_m2: 4}, path: {kind: straight, start: [9, 9]}}\n"
    )
    done = subprocess.run([*IRSIM, "check", "s.yaml"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.splitlines()[0] == "irsim: ZeroDivisionError: division by zero"
    assert done.stderr.splitlines()[1].endswith('bad_kind.py", line 4, in draw')
    assert len(done.stderr.splitlines()) <= 4


def test_kinds_of_installed_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lakes.py").write_text("from irsim.backgrounds import Sky\nclass Lake(Sky):\n    depth_m: float = 3\n")
    (tmp_path / "lakes-1.dist-info").mkdir()
    (tmp_path / "lakes-1.dist-info" / "METADATA").write_text("Name: lakes\nVersion: 1\n")
    (tmp_path / "lakes-1.dist-info" / "entry_points.txt").write_text("[irsim.background]\nlake = lakes:Lake\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    scenario = irsim.loads("background: {kind: lake, depth_m: 4}")
    assert type(scenario.background).__name__ == "Lake"
    assert irsim.loads(irsim.dumps(scenario)) == scenario

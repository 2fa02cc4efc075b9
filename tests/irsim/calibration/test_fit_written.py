"""What `irsim fit -o` replaces."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.errors import InputError

SCENE = "frames: 12\ncamera: {size: [64, 64]}\nbackground: {kind: ground, spread_k: 0}\n"


def test_a_fit_replaces_nothing_but_a_fit_as_it_was_written(tmp_path: Path) -> None:
    """A scene of that name stays as it is, and so does a fit in which anything was changed."""
    scene, camera = tmp_path / "scene.yaml", tmp_path / "camera.yaml"
    scene.write_text(SCENE)
    words = ["fit", str(scene), "-o", str(camera), "--frames", "12"]
    for _ in range(2):
        assert CliRunner().invoke(app, words).exit_code == 0
    fitted = camera.read_text()
    for text, said in (
        (scene.read_text(), "is there already, irsim fit has not written it, and a fit would replace it; allowed: ano"),
        ("", "is there already"),
        (
            f"{fitted}targets: []\n",
            "camera.yaml: was changed after irsim fit wrote it, and a fit would replace it; allow",
        ),
        (f"{fitted}# my own\n", "was changed after"),
        (fitted.replace("psf_px: ", "psf_px: 1"), "was changed after"),
        (fitted.replace("frames: 12\n", "frames: 50\n"), "was changed after"),
        (
            fitted.rpartition("# A later fit")[0],
            "irsim fit has not written it like this, the last line of a fit is mis",
        ),
    ):
        assert text != fitted
        camera.write_text(text)
        done = CliRunner().invoke(app, words)
        assert isinstance(done.exception, InputError)
        assert said in str(done.exception)
        assert camera.read_text() == text
    camera.write_text(fitted)
    assert CliRunner().invoke(app, words).exit_code == 0


def test_a_fit_that_went_to_standard_output_is_one_too(tmp_path: Path) -> None:
    scene, camera = tmp_path / "scene.yaml", tmp_path / "camera.yaml"
    scene.write_text(SCENE)
    camera.write_text(CliRunner().invoke(app, ["fit", str(scene)]).stdout)
    assert CliRunner().invoke(app, ["fit", str(scene), "-o", str(camera)]).exit_code == 0
    assert CliRunner().invoke(app, ["show", str(camera), "-o", str(tmp_path / "shown.png")]).exit_code == 0


def test_a_fit_that_was_written_from_python_is_one_too(tmp_path: Path) -> None:
    """Where no sentence speaks of options, both write the same."""
    scene, camera = tmp_path / "scene.yaml", tmp_path / "camera.yaml"
    scene.write_text(SCENE)
    camera.write_text(irsim.fit(scene).text)
    assert CliRunner().invoke(app, ["fit", str(scene), "-o", str(camera)]).exit_code == 0
    assert irsim.loads(camera.read_text()) == irsim.fit(scene).scenario

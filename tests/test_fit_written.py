"""What `irsim fit -o` replaces."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from irsim.cli import app
from irsim.errors import InputError

SCENE = "frames: 12\ncamera: {size: [64, 64]}\nbackground: {kind: ground, spread_k: 0}\n"


def test_a_fit_replaces_nothing_but_a_fit(tmp_path: Path) -> None:
    """A scene of that name stays as it is, and so does a fit to which targets were added."""
    scene, camera = tmp_path / "scene.yaml", tmp_path / "camera.yaml"
    scene.write_text(SCENE)
    words = ["fit", str(scene), "-o", str(camera), "--frames", "12"]
    for _ in range(2):
        assert CliRunner().invoke(app, words).exit_code == 0
    fitted = camera.read_text()
    for text, said in (
        (scene.read_text(), "is there already, irsim fit has not written it, and a fit would replace it; allowed: ano"),
        ("", "is there already"),
        (f"{fitted}targets: []\n", f"camera.yaml:{len(fitted.splitlines()) + 1}: holds targets that were added to it"),
    ):
        camera.write_text(text)
        done = CliRunner().invoke(app, words)
        assert isinstance(done.exception, InputError)
        assert said in str(done.exception)
        assert camera.read_text() == text

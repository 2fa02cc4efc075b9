"""Recordings whose scenario is none: what asks for some of it finds nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
from recording_fakes import Noise
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.errors import InputError
from irsim.measure import perhaps_pictures
from irsim.recording import open_recording, record
from irsim.stated import stated


@dataclass(frozen=True)
class Told(Noise):
    """Random pictures of 8 bits, of which a text says where they come from."""

    count: int = 16
    size: tuple[int, int] = (64, 48)
    bits: int = 8
    has_truth: bool = False
    told: str = ""

    @property
    def scenario_text(self) -> str:
        return self.told


@pytest.mark.parametrize("text", ["- 1", "3", "null"])
def test_a_scenario_that_is_no_mapping_says_nothing(tmp_path: Path, text: str) -> None:
    path = record(Told(told=text), tmp_path / "a.mcap")
    recording = open_recording(path)
    assert recording.scenario_text == text
    assert stated(recording) == {}
    assert perhaps_pictures(recording)
    for command in ("noise", "fit", "realism"):
        done = CliRunner().invoke(app, [command, str(path)])
        assert isinstance(done.exception, InputError | None), done.exception
        if done.exception is not None:
            assert str(done.exception).startswith(f"{path}: ")
            assert len(str(done.exception).splitlines()) == 1


def test_a_scenario_says_its_top_keys() -> None:
    assert stated(Told(told="like: cloud\nframes: 3")) == {"like": "cloud", "frames": 3}
    assert stated(Noise()) == {}
    assert not perhaps_pictures(Told(told="background: {kind: sky}"))
    assert perhaps_pictures(Told(told="background: {kind: recording}"))
    with pytest.raises(InputError, match="noise:1:"):
        stated(Told(told="a: [1"))

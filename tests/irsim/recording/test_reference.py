"""Reference recordings are read bit for bit."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

import irsim

FOLDER = Path(__file__).parents[3] / "recordings" / "reference"
DIGESTS = {"car": "c73451eb3c1a17bc", "drone": "627f6d3267ba489e", "jet": "dcd9ef89f132d229"}
"""blake2b (8 bytes) of all counts, in order."""


def test_every_reference_is_known() -> None:
    assert {path.stem for path in FOLDER.glob("*.mcap")} == set(DIGESTS)


@pytest.mark.parametrize("name", DIGESTS)
def test_counts_of_a_reference(name: str) -> None:
    recording = irsim.open_recording(FOLDER / f"{name}.mcap")
    digest = hashlib.blake2b(digest_size=8)
    for frame in recording.frames():
        digest.update(frame.image.tobytes())
    assert digest.hexdigest() == DIGESTS[name]
    assert len(list(recording.truths())) == len(recording)

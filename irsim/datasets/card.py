"""Card of a data set, card.json: its contents, its origin, and the clips that are whole."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from irsim import __version__
from irsim.datasets.plan import Job, Settings
from irsim.datasets.splits import SPLITS
from irsim.errors import counted
from irsim.recording.formats.folder import JPEG_QUALITY, PNG_LEVEL
from irsim.recording.output import atomic_text
from irsim.render.masks import HALF

CARD = "card.json"


class Written(NamedTuple):
    """Clip that is written wholly: the writer's value, the number of labels, and the digest of its files."""

    part: Any
    labels: int
    digest: str


class Card:
    """Card of a data set. It is written before the first clip, after each clip, and last with `complete`: true."""

    def __init__(self, planned: Sequence[Job], settings: Settings, command: str) -> None:
        self._planned, self._path = planned, settings.root / CARD
        self._whole: dict[str, Written] = {}
        splits = [job.clip.split for job in planned]
        about = f"{counted(len(planned), 'clip')} of infrared scenes with ground truth, in the format {settings.format}"
        labels = f"targets in the picture, of a visible fraction of at least {settings.min_visible:g}"
        masks = f"masks: pixels with at least {HALF:g} of the target's greatest coverage"
        self._facts = {
            "about": about,
            "command": command,
            "versions": {
                "irsim": __version__,
                "python": platform.python_version(),
                "numpy": np.__version__,
                "opencv": cv2.__version__,
            },
            "format": settings.format,
            "pictures": f"{settings.input}, PNG level {PNG_LEVEL}, JPEG quality {JPEG_QUALITY}",
            "labels": f"{labels}; {masks}",
            "classes": list(planned[0].clip.classes),
            "split": {name: splits.count(name) for name in SPLITS if name in splits},
        }
        self._write()

    def add(self, job: Job, written: Written) -> None:
        """Add a clip that is whole."""
        self._whole[job.clip.name] = written
        self._write()

    def part(self, job: Job) -> Any:
        """Return the writer's value of a clip that is whole."""
        return self._whole[job.clip.name].part

    def finish(self, digest: str) -> None:
        """Write the card of the whole data set. `digest`: of the files that belong to no clip."""
        digests = "".join([*(self._whole[job.clip.name].digest for job in self._planned), digest])
        self._facts["digest"] = hashlib.blake2b(digests.encode(), digest_size=16).hexdigest()
        self._write(complete=True)

    def _write(self, complete: bool = False) -> None:
        whole = [_facts(job, self._whole[job.clip.name]) for job in self._planned if job.clip.name in self._whole]
        missing = [job.clip.name for job in self._planned if job.clip.name not in self._whole]
        value = {**self._facts, "complete": complete, "whole": whole, "missing": missing}
        with atomic_text(self._path) as file:
            file.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")


def _facts(job: Job, written: Written) -> dict[str, Any]:
    clip = job.clip
    return {
        "name": clip.name,
        "split": clip.split,
        "source": job.word,
        "seed": job.source.seed,
        "scene": job.source.hash,
        "frames": clip.frames,
        "size": clip.size,
        "bits": clip.bits,
        "rate_hz": clip.rate_hz,
        "targets": clip.ids,
        "labels": written.labels,
        "digest": written.digest,
    }

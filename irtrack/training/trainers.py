"""Training of one kind of model: frames of development seeds, the trainer, the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from irsim.config.base import suggestion
from irsim.recording.output import check_output
from irtrack.errors import InputError
from irtrack.models.files import Card, write_model
from irtrack.training.adaboost import train_adaboost
from irtrack.training.frames import SEEDS, LabelledFrame, Progress, Set, labelled_frames
from irtrack.training.hog import train_hog
from irtrack.training.identity import train_identity

Trainer = Callable[[Mapping[Set, Sequence[LabelledFrame]], str], tuple[Any, Card]]
KINDS: dict[str, Trainer] = {"hog": train_hog, "adaboost": train_adaboost, "identity": train_identity}


def train(kind: str, output: Path, command: str, progress: Progress | None = None) -> Card:
    """Train a model of a kind on frames of development seeds, write its file, and return its card.

    InputError for an unknown kind, and for a file that cannot be written.
    """
    if kind not in KINDS:
        raise InputError(f"'{kind}': no kind of model; allowed: {', '.join(KINDS)}{suggestion(kind, KINDS)}")
    check_output(output, endings=(".json",))
    frames: dict[Set, list[LabelledFrame]] = {
        each: labelled_frames(seeds, progress=progress) for each, seeds in SEEDS.items()
    }
    model, card = KINDS[kind](frames, command)
    write_model(output, kind, card, model.values())
    return card

"""Training on a few rendered frames: windows, hard negatives, files that trackers read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irtrack.features.window import overlaps
from irtrack.models.files import read_card
from irtrack.registry.table import make
from irtrack.training import adaboost, frames, hog, identity, train
from irtrack.training.frames import LabelledFrame, Set, labelled_frames
from irtrack.training.windows import MOST_OVERLAP, windows_of

SCENES = ["sources/cheng-sky", "stress/hard-14x10"]


@pytest.fixture(scope="module")
def few() -> dict[Set, list[LabelledFrame]]:
    """Two scenarios, one seed a set, three frames each."""
    sets: list[Set] = ["training", "calibration", "scores"]
    return {name: labelled_frames([7 + k], SCENES, 3) for k, name in enumerate(sets)}


def test_windows_are_apart_from_targets(few: dict[Set, list[LabelledFrame]]) -> None:
    count = 0
    for part in windows_of(few["training"], (10, 10)):
        shared = overlaps(part.given, part.boxes).max(axis=1)
        assert (shared[~part.positive] <= MOST_OVERLAP).all()
        assert (shared[part.positive] > 0.3).all()
        grid = part.grid(0.25, (1.0, 1.25))
        assert (overlaps(grid[part.negative(grid)], part.boxes).max(axis=1) <= MOST_OVERLAP).all()
        count += int(part.positive.sum())
    assert count >= 6 * 2


def test_trained_models_find_targets_and_repeat(
    few: dict[Set, list[LabelledFrame]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adaboost, "STUMPS", (3, 8))
    monkeypatch.setattr(adaboost, "FEATURES", 120)
    one, card = hog.train_hog(few, "irtrack train hog")
    again, _ = hog.train_hog(few, "irtrack train hog")
    np.testing.assert_array_equal(one.svm.w, again.svm.w)
    assert card.scores["area under ROC"] > 0.8
    boosted, boosted_card = adaboost.train_adaboost(few, "irtrack train adaboost")
    assert boosted_card.scores["training error"] <= boosted_card.scores["bound of the training error"]
    assert len(boosted.stumps.alpha) <= 8
    for kind, model, made, tracker in (
        ("hog", one, card, "hog_pf"),
        ("adaboost", boosted, boosted_card, "adaboost_pf"),
    ):
        from irtrack.models.files import write_model

        path = tmp_path / f"{kind}.json"
        write_model(path, kind, made, model.values())
        assert read_card(path, kind)["command"] == f"irtrack train {kind}"
        read = make(tracker, {"model": str(path)}).classifier  # type: ignore[attr-defined]  # of these trackers
        for key, value in model.values().items():
            np.testing.assert_allclose(read.values()[key], value, rtol=1e-6)


def test_command_trains_on_its_seeds(
    few: dict[Set, list[LabelledFrame]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command's function renders each set's seeds; classes that a set lacks are left out."""
    seen: list[list[int]] = []

    def rendered(seeds: list[int], progress: object = None) -> list[LabelledFrame]:
        seen.append(list(seeds))
        return list(few.values())[len(seen) - 1]

    monkeypatch.setattr("irtrack.training.trainers.labelled_frames", rendered)
    card = train("identity", tmp_path / "identity.json", "irtrack train identity")
    assert seen == list(frames.SEEDS.values())
    assert set(card.examples) == {"aircraft", "vehicle"}
    assert set(card.examples) <= set(identity.NAMES)
    assert make("identity", {"model": str(tmp_path / "identity.json")}).recogniser.classes == ("aircraft", "vehicle")  # type: ignore[attr-defined]  # of this tracker

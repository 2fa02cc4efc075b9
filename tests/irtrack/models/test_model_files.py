"""Model files: shipped ones with cards; missing, old, changed and other files are one clear line each."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from irsim.rng import stream
from irtrack.errors import InputError
from irtrack.models.files import FORMAT, MOST_BYTES, SHIPPED, read_card, read_model
from irtrack.registry.identity import weights_digest
from irtrack.registry.table import make

KINDS = sorted(path.stem for path in SHIPPED.glob("*.json"))


@pytest.mark.parametrize("kind", KINDS)
def test_shipped_models_are_small_and_have_cards(kind: str) -> None:
    path = SHIPPED / f"{kind}.json"
    assert path.stat().st_size < MOST_BYTES
    card = read_card(path, kind)
    assert card["command"] == f"irtrack train {kind} -o irtrack/models/{kind}.json"
    seeds = list(card["seeds"].values())
    assert len(seeds) == 3
    assert len({seed for part in seeds for seed in part}) == sum(map(len, seeds))
    assert all(1000 <= seed < 2000 for part in seeds for seed in part)
    assert all(count > 0 for count in card["examples"].values())
    assert card["scores"]


def test_wrong_files_are_one_line(tmp_path: Path) -> None:
    body = json.loads((SHIPPED / "hog.json").read_text())
    old = body | {"format": FORMAT - 1}
    changed = body | {"values": body["values"] | {"b": 0.0}}
    texts = {
        "old": (json.dumps(old), f"format {FORMAT - 1}; allowed: format {FORMAT}"),
        "changed": (json.dumps(changed), "was changed after it was written"),
        "other": (json.dumps(body | {"kind": "adaboost"}), "kind adaboost"),
        "list": ("[1, 2]", "is no model file"),
        "empty": ("", "is no model file"),
    }
    for name, (text, message) in texts.items():
        path = tmp_path / f"{name}.json"
        path.write_text(text)
        with pytest.raises(InputError, match=message) as caught:
            read_model(path, "hog")
        assert "\n" not in str(caught.value)
        assert "irtrack train hog" in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        read_model(tmp_path / "none.json", "hog")


def test_a_tracker_names_its_wrong_model(tmp_path: Path) -> None:
    from tracker_scenes import blob

    from irsim.types import Box

    path = tmp_path / "model.json"
    path.write_text("{}")
    frame = blob(0, count=1)[0][0]
    with pytest.raises(InputError, match="is no model file"):
        make("hog_pf", {"model": str(path)}).init(frame, Box(80, 60, 14, 10), stream(0, 0))
    assert weights_digest(make("hog_pf", {"model": str(path)})) != weights_digest(make("hog_pf"))

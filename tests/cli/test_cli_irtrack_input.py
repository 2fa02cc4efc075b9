"""Bad input to irtrack: one line, status 2, and nothing left behind."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Call

BAD = [
    (("run", "grey_pff", "clip.mcap"), "did you mean 'grey_pf'?"),
    (("run", "nowhere:Tracker", "clip.mcap"), "nowhere"),
    (("run", "grey_pf", "none.mcap"), "none.mcap"),
    (("run", "grey_pf", "none.yaml"), "none.yaml"),
    (("run", "grey_pf", "cut.mcap"), "cut.mcap"),
    (("run", "grey_pf", "empty.mcap"), "empty.mcap"),
    (("run", "grey_pf", "clip.mcap", "particels=3"), "did you mean 'particles'?"),
    (("run", "grey_pf:particels=3", "clip.mcap"), "did you mean 'particles'?"),
    (("run", "grey_pf:particles=30", "clip.mcap", "particles=40"), "'particles' is given twice"),
    (("run", "grey_pf", "clip.mcap", "particles=0"), "particles"),
    (("run", "grey_pf", "clip.mcap", "particles=many"), "particles"),
    (("run", "grey_pf", "clip.mcap", "particles"), "KEY=VALUE"),
    (("run", "grey_pf", "clip.mcap", "camera.netd_mk=3"), "camera.netd_mk=3"),
    (("run", "grey_pf", "scene.yaml", "camera.netd=3"), "did you mean 'netd_mk'?"),
    (("run", "grey_pf", "clip.mcap", "--target", "jett"), "did you mean 'jet'?"),
    (("run", "grey_pf", "clip.mcap", "--init", "500,500,9,9"), "outside the frame"),
    (("run", "grey_pf", "clip.mcap", "--init", "1,2,1e9,4"), "larger than the frame; allowed: at most"),
    (("run", "grey_pf", "clip.mcap", "--init", "5,5,9"), "X,Y,W,H"),
    (("run", "grey_pf", "clip.mcap", "--init", "5,5,9,9@99"), "no such frame"),
    (("run", "grey_pf", "clip.mcap", "--input", "colour"), "display or counts"),
    (("run", "grey_pf", "clip.mcap", "-o", "no/track.mcap"), "the folder no does not exist"),
    (("run", "grey_pf", "clip.mcap", "--csv", "no/track.csv"), "the folder no does not exist"),
    (("bench", "clip.mcap", "--trackers", "grey_pff", "--results", "x.db"), "did you mean 'grey_pf'?"),
    (("bench", "clip.mcap", "--trackers", "grey_pf:particels=3", "--results", "x.db"), "did you mean 'particles'?"),
    (("bench", "clip.mcap", "--trackers", "grey_pf,grey_pf", "--results", "x.db"), "differ, as in NEW=grey_pf\n"),
    (("bench", "clip.mcap", "--trackers", "a=kalman,a=template", "--results", "x.db"), "differ, as in NEW=template\n"),
    (("bench", "suites/quick", "--results", "x.db"), "did you mean 'suites/quick-suite'?"),
    (("bench", "quick-suite", "--results", "x.db"), "did you mean 'suites/quick-suite'?"),
    (("bench", "clip.mcap", "--results", "x.db"), "--trackers: is missing"),
    (("check", "kalman", "--only", ""), "--only '': a name is empty"),
    (("check", "kalman", "--only", "flip,"), "--only 'flip,': a name is empty"),
    (("stress", "kalman", "--only", "", "--results", "x.db"), "--only '': a name is empty"),
    (("papers", "--only", "", "-o", "x"), "--only '': a name is empty"),
    (("train", "hogg"), "did you mean 'hog'?"),
    (("train", "hog", "-o", "no/hog.json"), "the folder no does not exist"),
    (("train", "hog", "-o", "hog.txt"), "allowed: a name that ends in .json"),
    (("run", "hog_pf", "clip.mcap", "model=clip.mcap"), "is no model file; allowed: a file of irtrack train hog"),
    (("compare", "a", "b", "--metrics", ""), "--metrics '': a name is empty"),
    (("bench", "none.mcap", "--trackers", "grey_pf", "--results", "x.db"), "none.mcap"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--results", "no/x.db"), "the folder no does not exist"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--results", "scene.yaml"), "scene.yaml"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--target", "jett", "--results", "x.db"), "did you mean 'jet'?"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--results", "clip.mcap"), "would replace clip.mcap"),
    (("bench", "A=clip.mcap", "--trackers", "kalman", "--results", "clip.mcap"), "would replace clip.mcap"),
    (("bench", "clip.mcap", "./clip.mcap", "--trackers", "kalman", "--results", "x.db"), "as in NEW=./clip.mcap"),
    (
        ("bench", "clip.mcap", "particles=300", "--trackers", "grey_pf", "--results", "x.db"),
        "KEY=VALUE sets scenario keys; tracker parameters: --trackers NAME:KEY=VALUE\n",
    ),
    (("bench", "scene.yaml", "frame=3", "--trackers", "kalman", "--results", "x.db"), "did you mean 'frames'?"),
    (("bench", "scene.yaml", "camera.netd=3", "--trackers", "kalman", "--results", "x.db"), "did you mean 'netd_mk'?"),
    (("bench", "clip.mcap", "frames=3", "--trackers", "kalman", "--results", "x.db"), "clip.mcap"),
    (("bench", "scene.yaml", "seed=3", "--trackers", "kalman", "--results", "x.db"), "allowed: --seeds N"),
    (("bench", "frames=3", "--trackers", "kalman", "--results", "x.db"), "frames=3: no source"),
    (("bench", "suites/quick-suite", "frames=3", "--results", "x.db"), "under the key `changes`"),
    (("bench", "sweep.yaml", "--results", "x.db"), "sweep.yaml:1:1: has the keys of a suite, not of a scenario"),
    (("run", "kalman", "sweep.yaml"), "sweep.yaml:1:1: has the keys of a suite, not of a scenario"),
    (("run", "kalman", "clip.mcap", "-o", "clip.mcap"), "would replace clip.mcap"),
    (("run", "kalman", "clip.mcap", "--csv", "clip.mcap"), "would replace clip.mcap"),
    (("run", "kalman", "scene.yaml", "-o", "scene.yaml"), "would replace scene.yaml"),
    (("run", "kalman", "clip.mcap", "-o", "same", "--csv", "same"), "would replace same"),
    (("run", "kalman", "clip.mcap", "-o", "track.csv"), "track.csv: allowed: a name that ends in .mcap"),
    (("run", "kalman", "clip.mcap", "--csv", "track.md"), "track.md: allowed: a name that ends in .csv"),
    (("bench", "clip.mcap", "--trackers", "kalman", "--results", "x.csv"), "x.csv: allowed: a name that ends in .db"),
    (("compare", "a", "b", "--junit", "x.html"), "x.html: allowed: a name that ends in .xml"),
    (("run", "kalman", "clip.mcap", "gate=3", "gate=4"), "'gate' is given twice"),
    (("run", "kalman", "."), "irsim import"),
    (("run", "./mine.py:Reaching", "clip.mcap"), "did you mean 'mine:Reaching'?"),
    (("run", "mine:Typed", "clip.mcap", "reach=x"), "mine:Typed: reach: expected a whole number, not 'x'"),
    (("run", "mine:Reaching", "clip.mcap", "bogus=3"), "allowed: the tracker's reach\n"),
    (("report", "clip.mcap", "-o", "clip.mcap"), "would replace clip.mcap"),
    (("report", "none.db"), "none.db"),
    (("report", "clip.mcap"), "clip.mcap"),
    (("report", "none.db", "-o", "no/report.html"), "the folder no does not exist"),
]


@pytest.mark.parametrize(("words", "said"), BAD, ids=lambda value: " ".join(value) if isinstance(value, tuple) else "")
def test_bad_input_is_one_line(call: Call, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    before = {path.name for path in tmp_path.iterdir()}
    answer = call(*words)
    assert answer.status == 2
    assert answer.out == ""
    assert answer.err.startswith("irtrack: ")
    assert answer.err.count("\n") == 1
    assert said in answer.err
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("words", [("run", "grey_pf"), ("bench", "clip.mcap"), ("walk",), ("bench", "--seeds", "x")])
def test_wrong_usage_has_status_2(call: Call, words: tuple[str, ...]) -> None:
    answer = call(*words)
    assert answer.status == 2
    assert answer.out == ""
    assert "Traceback" not in answer.err


@pytest.mark.parametrize(
    "words", [("run", "kalman", "scene.yaml"), ("bench", "scene.yaml", "again=scene.yaml", "--check")]
)
def test_override_without_effect_is_warned_of_once(call: Call, words: tuple[str, ...]) -> None:
    trackers = ("--trackers", "kalman") if words[0] == "bench" else ()
    answer = call(*words, "camera.detector={kind: electrons}", "camera.netd_mk=5000", *trackers)
    assert answer.status == 0
    warning = "override camera.netd_mk: warning: does not count for a detector of kind electrons: its own keys decide"
    assert answer.err.splitlines() == [warning]

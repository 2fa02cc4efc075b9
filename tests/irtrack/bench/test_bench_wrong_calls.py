"""Wrong arguments of public functions of irtrack are errors of one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import irsim
import irtrack
from irsim.errors import InputError
from irtrack.cli.track_files import track_to_csv

SCENE = irsim.loads(
    "frames: 3\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
    "targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 9]}}]\n"
)
NO_PATH = "is no path; allowed: text or a path"


def anything(value: object) -> Any:
    """Return a value without its type."""
    return value


CALLS: dict[str, tuple[Callable[[], object], str]] = {
    "track_to_csv": (lambda: track_to_csv(irtrack.run("kalman", SCENE, target="jet"), anything(3)), NO_PATH),
    "Results": (lambda: irtrack.Results(anything(None)), NO_PATH),
    "export": (lambda: irtrack.export(anything(3), "x.csv"), NO_PATH),
    "write_report": (lambda: irtrack.write_report(anything(None)), NO_PATH),
    "run_bench": (lambda: irtrack.run_bench([SCENE], ["kalman"], results=anything(None)), NO_PATH),
    "kept_failures": (lambda: irtrack.kept_failures(anything(None)), NO_PATH),
    "find_failure": (lambda: irtrack.find_failure(SCENE, "kalman", anything(None)), NO_PATH),
    "no step between anchors": (lambda: irtrack.run_anchors("kalman", SCENE, every=0), "every 0: allowed: 1 or more"),
    "no track": (
        lambda: irtrack.score(anything(None), SCENE),
        "track: a NoneType; allowed: a Track, the result of irtrack.run",
    ),
    "an array for a parameter": (
        lambda: irtrack.make("grey_pf", {"particles": np.zeros(2)}),
        r"grey_pf: a numpy\.ndarray cannot be written as YAML; allowed: text, ",
    ),
    "no tracker's name": (lambda: irtrack.make(anything(None)), "tracker None: is no name; allowed: text"),
}


@pytest.mark.parametrize("call", CALLS)
def test_wrong_argument_is_one_line(call: str) -> None:
    run, told = CALLS[call]
    with pytest.raises(InputError, match=told) as caught:
        run()
    assert len(str(caught.value).splitlines()) == 1

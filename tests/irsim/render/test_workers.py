"""Frames rendered by worker processes are those of one process; errors, dead workers and leftovers."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import runs

import irsim
from irsim.render.workers import rendered
from irsim.scenario.model import Scenario

NOISE: list[dict[str, Any]] = [{"kind": "white"}, {"kind": "fixed_pattern"}, {"kind": "ar1", "rho": 0.9}]
ON_LINUX = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="takes Linux's /proc")


def scene(frames: int = 100, camera: dict[str, Any] | None = None, **other: Any) -> Scenario:
    """A small sky with evolving clouds, noise with memory and a moving camera."""
    return Scenario.model_validate(
        {
            "frames": frames,
            "camera": {
                "size": (48, 32),
                "rate_hz": 10,
                "noise": NOISE,
                "motion": [{"kind": "pan", "azimuth_deg_s": 0.3}, {"kind": "jitter"}],
                **(camera or {}),
            },
            "background": {"kind": "sky", "clouds": [{"evolve_s": 4.0, "sunlit_k": 5.0}]},
            **other,
        }
    )


def test_workers_give_the_frames_of_one_process() -> None:
    """Frames that are kept stay the same though memory is used again; a caller may write to them."""
    camera = {
        "time_constant_ms": 60.0,
        "correction": {"period_frames": 40, "freeze_frames": 12},
        "faults": [{"kind": "drop", "frames": [3]}],
    }
    scenario, kept = scene(camera=camera), []
    expected = list(irsim.frames(scenario))
    for number, (frame, truth) in enumerate(irsim.frames(scenario, jobs=2)):
        assert truth == expected[number][1]
        assert (frame.index, frame.time, frame.bits) == (number, truth.time, scenario.camera.bits)
        kept.append(frame.image.copy())
        if number % 3:
            frame.image[:] = 0
        else:
            kept[-1] = frame.image
    assert np.array_equal(kept, [frame.image for frame, _ in expected])


def test_frames_before_one_that_fails_are_given() -> None:
    fails = 13  # within a batch of truths
    scenario = scene(40, {"noise": [{"kind": "failing_noise:Failing", "at": fails}]})
    frames = irsim.frames(scenario, jobs=2)
    assert [next(frames)[0].index for _ in range(fails)] == list(range(fails))
    with pytest.raises(ValueError, match=rf"^frame {fails} cannot be\nin a worker process") as raised:
        next(frames)
    assert "in pattern" in raised.value.__notes__[0]  # the worker's traceback


@ON_LINUX
@pytest.mark.parametrize(
    ("kill", "error", "text"),
    [
        (
            True,
            irsim.IrsimError,
            r"^a worker process died (while it rendered|before its first frame) \(SIGKILL\); allowed: ",
        ),
        (False, ZeroDivisionError, "in the program"),
    ],
    ids=["worker killed", "consumer raises"],
)
def test_workers_end_with_an_error(kill: bool, error: type[Exception], text: str) -> None:
    workers: list[int] = []

    def take() -> None:
        with closing(rendered(scene(4000), range(4000), 2)) as frames:
            for _ in frames:
                if not workers:
                    workers.extend(child.pid or 0 for child in multiprocessing.active_children())
                    if not kill:
                        raise ZeroDivisionError("in the program")
                    os.kill(workers[0], signal.SIGKILL)

    with pytest.raises(error, match=text):
        take()
    assert len(workers) == 2
    assert not any(map(runs, workers))


SCRIPT = """
import irsim, os, signal
if __name__ == "__main__":
    for index, pair in enumerate(irsim.frames(irsim.load("sky", ["frames=4000", "camera.size=[48, 32]"]), jobs=2)):
        if index == 40:
            {end}
"""


@pytest.mark.slow
@ON_LINUX
@pytest.mark.parametrize(
    "end",
    ["break", pytest.param("os.kill(os.getpid(), signal.SIGKILL)", marks=pytest.mark.slow)],
    ids=["break", "kill"],
)
def test_program_that_ends_leaves_nothing_on_stderr(end: str, tmp_path: Path) -> None:
    """No process, and no warning of shared memory on stderr."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(end=end))
    done = subprocess.run([sys.executable, "-W", "error", script], capture_output=True, text=True, check=False)
    assert done.returncode == (-9 if "SIGKILL" in end else 0)
    assert done.stderr == ""

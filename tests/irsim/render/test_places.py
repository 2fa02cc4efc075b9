"""What workers put into memory that they share, and send by the pipe where there is none."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest
from processes import runs

import irsim
from irsim.render import workers as crew
from irsim.render.division import DIVIDED, WHOLE, Way
from irsim.render.frame import Renderer
from irsim.render.shared_memory import shared
from irsim.render.workers import rendered

PROC = Path("/proc/self")
ON_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="takes Linux's /proc")

SCENE = ["frames=150", "camera.size=[48, 32]"]
"""More frames than have places at once."""


@pytest.mark.parametrize(("size", "holds"), [(0, 0), (95, 0), (96, 1), (287, 2), (288, 3)])
def test_memory_holds_whole_pictures(size: int, holds: int) -> None:
    with shared(size) as memory:
        pictures = [memory.picture(place, (6, 8), np.uint16) for place in range(4)]
        assert [picture is not None for picture in pictures] == [place < holds for place in range(4)]
        for place, picture in enumerate(pictures[:holds]):
            assert picture is not None
            picture[:] = place
        for place in range(holds):
            assert np.array_equal(memory.picture(place, (6, 8), np.uint16), np.full((6, 8), place))  # type: ignore[arg-type]  # None would be a fault, and fail


def images(jobs: int) -> list[np.ndarray]:
    return [frame.image for frame, _ in irsim.frames(irsim.load("sky", SCENE), jobs=jobs)]


@pytest.fixture(scope="module")
def expected() -> list[np.ndarray]:
    return images(1)


@pytest.mark.parametrize("most", [crew.MOST_WAITING, 0], ids=["long-chunks", "short-chunks"])
def test_places_that_are_used_again_change_no_frame_that_was_handed_out(
    most: int, way: Way, expected: list[np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(crew, "MOST_WAITING", most)
    assert np.array_equal(images(2), expected)


def test_frames_that_are_kept_for_a_while_or_written_to_stay_what_they_are(
    way: Way, expected: list[np.ndarray]
) -> None:
    kept: dict[int, np.ndarray] = {}
    for index, (frame, _) in enumerate(irsim.frames(irsim.load("sky", SCENE), jobs=2)):
        assert np.array_equal(frame.image, expected[index])
        if index % 7 == 0:
            kept[index] = frame.image
        else:
            frame.image[:] = 0
        if index % 70 == 0:
            kept.clear()
    for index, image in kept.items():
        assert np.array_equal(image, expected[index])


@pytest.mark.parametrize(
    ("jobs", "size", "length", "divided"),
    [
        (2, (640, 512), 64, 8),
        (2, (1280, 1024), 16, 8),
        (8, (640, 512), 32, 8),
        (2, (4096, 4096), 1, 1),
        (10_000, (640, 512), 1, 1),
    ],
)
def test_what_waits_is_bounded(
    jobs: int, size: tuple[int, int], length: int, divided: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many workers and however large the frames: memory that is shared is taken from the machine at once."""
    asked = []

    def spy(size: int) -> None:
        asked.append(size)
        raise InterruptedError

    monkeypatch.setattr(crew, "shared", spy)
    assert crew.chunk_length(WHOLE, jobs, size, 100_000) == length
    assert crew.chunk_length(DIVIDED, jobs, size, 100_000) == divided
    scene = irsim.load("sky", ["background.clouds=[]", f"camera.size=[{size[0]}, {size[1]}]"])  # never rendered
    with pytest.raises(InterruptedError):
        next(rendered(Renderer(scene), range(100_000), jobs))
    assert 0 < asked[0] <= crew.MOST_WAITING


@pytest.mark.parametrize(
    ("count", "length", "jobs"), [(0, 8, 2), (3, 1, 2), (100, 32, 2), (1500, 32, 2), (1500, 32, 7)]
)
def test_chunks_hold_every_frame_and_end_in_short_ones(count: int, length: int, jobs: int) -> None:
    chunks = list(crew.chunked(range(count), length, jobs))
    lengths = [len(chunk) for chunk in chunks]
    assert [index for chunk in chunks for index in chunk] == list(range(count))
    assert lengths == sorted(lengths, reverse=True)
    for k, each in enumerate(lengths):
        assert each in crew.LENGTHS
        assert each <= max(1, sum(lengths[k:]) // (2 * jobs))
        assert each == length or 2 * each * 2 * jobs > sum(lengths[k:])  # no shorter than that asks for


@contextmanager
def no_file_of(size: int) -> Iterator[None]:
    """No file of this process, in memory or not, may be so large."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@ON_LINUX
def test_without_shared_memory_frames_come_by_the_pipe(way: Way, expected: list[np.ndarray]) -> None:
    with no_file_of(size=1000):
        with shared(1000) as enough, shared(1001) as none:
            assert [memory.picture(0, (20, 25), np.uint16) is not None for memory in (enough, none)] == [True, False]
        assert np.array_equal(images(2), expected)


def test_where_memory_is_no_file_a_temporary_one_is_shared(
    way: Way, expected: list[np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "memfd_create", raising=False)
    with shared(1000) as memory:
        assert memory.picture(0, (20, 25), np.uint16) is not None
    assert np.array_equal(images(2), expected)


def held() -> list[str]:
    """The shared memory that this process has open or mapped."""
    maps = [line.split(maxsplit=5)[-1] for line in (PROC / "maps").read_text().splitlines()]
    opened = [os.readlink(path) for path in (PROC / "fd").iterdir() if path.is_symlink()]
    return [name for name in (*maps, *opened) if name.startswith("/memfd:irsim")]


def broken(pid: int) -> None:
    raise ZeroDivisionError("in the program")


def killed(pid: int) -> None:
    os.kill(pid, signal.SIGKILL)


@ON_LINUX
@pytest.mark.parametrize(
    ("meanwhile", "error", "said"),
    [
        (killed, irsim.IrsimError, r"^a worker process died while it rendered \(SIGKILL\); allowed: "),
        (broken, ZeroDivisionError, "in the program"),
    ],
    ids=["worker-killed", "raised"],
)
def test_nothing_is_left_of_frames_that_nobody_takes(
    meanwhile: Callable[[int], None], error: type[Exception], said: str, way: Way
) -> None:
    workers: set[int] = set()

    def take() -> None:
        with closing(rendered(Renderer(scene()), range(4000), 2)) as frames:
            for each in frames:
                if each.pid != os.getpid() and not workers:
                    workers.add(each.pid)
                    assert held()
                    meanwhile(each.pid)

    with pytest.raises(error, match=said):
        take()
    assert workers
    assert not any(map(runs, workers))
    assert not held()


def scene() -> irsim.Scenario:
    return irsim.load("sky", ["frames=4000", "camera.size=[48, 32]"])


SCRIPT = """
import irsim, os, signal
if __name__ == "__main__":
    for index, pair in enumerate(irsim.frames(irsim.load("sky", ["frames=4000", "camera.size=[48, 32]"]), jobs=2)):
        if index == 40:
            {end}
"""


@ON_LINUX
@pytest.mark.parametrize("end", ["break", "raise SystemExit", "os._exit(0)", "os.kill(os.getpid(), signal.SIGKILL)"])
def test_nobody_hears_of_memory_that_a_program_leaves_behind(end: str, tmp_path: Path) -> None:
    """multiprocessing's own memory is told of on stderr, and taken away, when a program is killed."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(end=end))
    done = subprocess.run([sys.executable, "-W", "error", script], capture_output=True, text=True, check=False)
    assert done.returncode == (-9 if "SIGKILL" in end else 0)
    assert done.stderr == ""

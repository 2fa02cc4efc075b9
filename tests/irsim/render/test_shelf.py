"""What processes work out for each other: it is what each would work out for itself, or it is not there."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from threading import Lock
from types import FrameType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import irsim
from irsim.backgrounds import evolving
from irsim.backgrounds.clouds import CloudShading
from irsim.render.division import Way
from irsim.render.frame import Renderer
from irsim.render.shared_cache import ENTRIES, HEAD, Shelf
from irsim.render.shared_memory import Shared
from irsim.render.workers import rendered


def memory(size: int) -> npt.NDArray[np.uint8]:
    return np.zeros(HEAD + size, np.uint8)


def made(number: int, size: int) -> npt.NDArray[np.uint16]:
    return np.arange(number, number + size).astype(np.uint16)


def asked(shelf: Shelf, number: int, size: int) -> bool:
    """Whether it had to be made; what is got is checked."""
    calls = []

    def make() -> npt.NDArray[np.uint16]:
        calls.append(number)
        return made(number, size)

    got = shelf.kept(("thing", number, 0.5), (size,), np.uint16, make)
    assert np.array_equal(got, made(number, size))
    got[:] = 0  # whoever gets it may write into it
    return bool(calls)


def test_it_keeps_nothing_until_it_is_open_and_afterwards() -> None:
    shelf, other = Shelf(), Shelf()
    common = memory(1000), Lock()
    assert asked(shelf, 1, 10)
    assert asked(shelf, 1, 10)
    other.open(*common)
    with shelf.opened(*common):
        assert asked(shelf, 1, 10)
        assert not asked(shelf, 1, 10)
        assert not asked(other, 1, 10)
    assert asked(shelf, 1, 10)
    assert not asked(other, 1, 10)


def test_the_newest_stay_and_what_needs_most_of_the_room_is_not_kept() -> None:
    shelf = Shelf()
    with shelf.opened(memory(1000), Lock()):
        assert [asked(shelf, number, 100) for number in range(8)] == [True] * 8
        assert [asked(shelf, number, 100) for number in range(7, 2, -1)] == [False] * 5
        assert asked(shelf, 0, 100)
        assert asked(shelf, 8, 251)
        assert asked(shelf, 8, 251)


def test_an_index_that_is_full_begins_anew() -> None:
    shelf = Shelf()
    with shelf.opened(memory(4 * ENTRIES), Lock()):
        assert all(asked(shelf, number, 1) for number in range(ENTRIES + 5))
        assert not asked(shelf, ENTRIES + 4, 1)
        assert not asked(shelf, 5, 1)
        assert asked(shelf, 4, 1)


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 60)), max_size=60), st.integers(1, 300))
def test_what_is_got_is_what_would_be_made(wanted: list[tuple[int, int]], size: int) -> None:
    """Whatever is put over what; a name always stands for one size."""
    shelves = [Shelf(), Shelf()]
    common = memory(size), Lock()
    sizes: dict[int, int] = {}
    with shelves[0].opened(*common), shelves[1].opened(*common):
        for number, length in wanted:
            asked(shelves[length % 2], number, sizes.setdefault(number, length))


@pytest.mark.parametrize("next_one", [0, 2])
def test_who_is_interrupted_leaves_nothing_that_is_not_whole(monkeypatch: pytest.MonkeyPatch, next_one: int) -> None:
    """Wherever in its code; its entry is another's, 0's, before."""
    monkeypatch.setattr("irsim.render.shared_cache.ENTRIES", 2)
    monkeypatch.setattr("irsim.render.shared_cache.HEAD", 8 * 7)
    steps, stopped = 0, True
    while stopped:
        shelf, common = Shelf(), (memory(0), Lock())
        with shelf.opened(*common):
            assert asked(shelf, 0, 1)
            assert asked(shelf, 1, 1)
            stopped = interrupted(steps, partial(asked, shelf, 2, 1))
            asked(shelf, next_one, 1)
        steps += 1
    assert steps > 20


def interrupted(steps: int, call: Callable[[], object]) -> bool:
    """Whether it was, after so many of Python's instructions in `put`."""
    left = steps

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal left
        if frame.f_code.co_name != "put":
            return None
        frame.f_trace_opcodes = True
        if event == "opcode":
            left -= 1
            if left < 0:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


def test_nobody_waits_for_one_that_never_gives_the_lock_back() -> None:
    lock = multiprocessing.get_context("spawn").Lock()
    shelf = Shelf()
    with shelf.opened(memory(1000), lock):
        assert asked(shelf, 1, 10)
        lock.acquire()
        assert asked(shelf, 1, 10)
        assert asked(shelf, 2, 10)
        lock.release()
        assert not asked(shelf, 1, 10)
        assert asked(shelf, 2, 10)


def test_without_memory_each_works_for_itself() -> None:
    shelf = Shelf()
    with shelf.opened(Shared().bytes, Lock()):
        assert asked(shelf, 1, 10)
        assert asked(shelf, 1, 10)


def living(*noise: dict[str, str]) -> irsim.Scenario:
    """A sky whose clouds are another state every few frames."""
    clouds = [{"id": "far", "evolve_s": 8.0}, {"id": "near", "evolve_s": 4.0, "sunlit_k": 5.0}]
    camera = {"size": (160, 120), "rate_hz": 10, "noise": noise}
    sky = {"kind": "sky", "clouds": clouds}
    return irsim.Scenario.model_validate({"frames": 96, "camera": camera, "background": sky})


def test_a_second_renderer_draws_and_paints_nothing_that_a_first_has(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, common = living(), (memory(128 << 20), Lock())
    first, second = Renderer(scene), Renderer(scene)
    with first.shelf.opened(*common), second.shelf.opened(*common):
        expected = [first.frame(index)[0].image for index in range(16)]

        def never(*_: object) -> None:
            raise AssertionError("it is there already")

        monkeypatch.setattr(evolving, "normals", never)
        monkeypatch.setattr(CloudShading, "paint", never)
        assert np.array_equal([second.frame(index)[0].image for index in range(16)], expected)


def test_clouds_that_two_processes_paint_for_each_other_change_no_frame(way: Way, tmp_path: Path) -> None:
    """The noise `rendezvous` adds nothing, and lets neither process render before the other is there."""
    expected = [frame.image for frame, _ in irsim.frames(living())]
    meeting = living({"kind": "rendezvous:Rendezvous", "folder": str(tmp_path)})
    found = list(rendered(Renderer(meeting), range(96), 2))
    assert len({each.pid for each in found}) == 2
    assert np.array_equal([each.frame.image for each in found], expected)

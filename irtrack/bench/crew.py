"""The worker processes of a bench: a tracker that hangs or kills its process costs no other tracker its results."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import Any

from irtrack.bench.reel import Reels
from irtrack.bench.run import Group, Member, Outcome, run_group
from irtrack.errors import InputError, IrtrackError
from irtrack.runner import Board, Deaths, GoneError, Limit, NotSentError, Pool, Watched


class Crew(Executor):
    """`run_group` in worker processes, as many at a time as there are jobs.

    A tracker that takes more than its limit is stopped with its process, one whose processes
    die has failed; its companions are run again. Where a process dies and nobody was at work, they are run one at a
    time: one of them may have left it unable to go on. With several jobs the calling script needs the guard
    ``if __name__ == "__main__"``.
    """

    def __init__(self, jobs: int, limit: Limit) -> None:
        self._wardens = Pool(jobs, partial(Warden, limit))
        self._threads = ThreadPoolExecutor(jobs)  # they only wait for the processes

    def submit(self, task: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The future of `run_group(group)`; nothing else can be asked of a crew."""
        assert task is run_group
        return self._threads.submit(self._run, *args)

    def _run(self, group: Group) -> list[Outcome]:
        with self._wardens.one() as warden:
            return warden.run(group)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes, whatever they are at."""
        self._wardens.close()
        self._threads.shutdown(wait, cancel_futures=cancel_futures)


@contextmanager
def warden(limit: Limit) -> Iterator[Warden]:
    """A warden, its process ended with the block."""
    found = Warden(limit)
    try:
        yield found
    finally:
        found.close()


class Warden:
    """One worker process at a time: another one is started where that one hangs or dies."""

    def __init__(self, limit: Limit) -> None:
        if multiprocessing.current_process().daemon:
            raise IrtrackError(
                "a time limit takes workers that may start processes; allowed for dask: "
                "DASK_DISTRIBUTED__WORKER__DAEMON=False dask worker ..."
            )
        self.limit = limit
        self._process = Watched(_begin, limit)

    def run(self, group: Group) -> list[Outcome]:
        """The outcomes of all members, in their order. What the source raises is passed on."""
        found: dict[Member, Outcome] = {}
        deaths, together = Deaths(group.name), True
        while left := [member for member in group.members if member not in found]:
            asked = left if together else left[:1]
            try:
                found |= zip(asked, self._process.ask(group.of(asked)), strict=True)
            except NotSentError as error:
                raise InputError(f"{group.name}: cannot be sent to a worker process: {error}") from None
            except GoneError as gone:
                if self._process.closed:
                    raise
                if gone.member is None and len(asked) > 1:
                    together = False
                    continue
                blame = deaths.blame(gone, self.limit.exceeded(), asked)
                if blame is not None:
                    if not blame.at_work:
                        self._run_without_trackers(group)
                    member = asked[blame.member]
                    found[member] = group.failed(member, blame.what, blame.frame)
        return [found[member] for member in group.members]

    def _run_without_trackers(self, group: Group) -> None:
        """IrtrackError where the source ends processes by itself."""
        deaths, done = Deaths(group.name), False
        while not done:
            try:
                done = self._process.ask(group.of(())) == []
            except GoneError as gone:
                if self._process.closed:
                    raise
                deaths.of_nobody(gone.how)

    def close(self) -> None:
        """End the process, whatever it is at; a warden that is waiting for it raises."""
        self._process.close()


def _begin(board: Board, limit: Limit) -> Callable[[Group], list[Outcome]]:
    """What a worker does with each group."""
    return partial(run_group, limit=limit, watch=board, reels=Reels())

"""Runners of functions: `Pool` in a fixed number of worker processes, `InProcess` in this one.

Both call ``function(heartbeat, *arguments)``. The function marks each frame of a tracker by
``with heartbeat.frame(index):``, so that a tracker that hangs or kills its process can be identified.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any, Protocol, TypeVar

from irtrack.errors import InputError
from irtrack.runner.watchdog import NO_LIMIT, Blame, CrashCount, Heartbeat, Limit, TrackerLostError, WorkerDiedError
from irtrack.runner.worker import NotSentError, Worker, one_thread

Result = TypeVar("Result")


class Runner(Protocol):
    """Runner, which calls functions in a process, and maps a function that uses it over items."""

    def call(
        self, function: Callable[..., Result], *arguments: object, limit: Limit = NO_LIMIT, name: str = ""
    ) -> Result:
        """Return function(heartbeat, *arguments), or raise its exception. TrackerLostError as in `Pool.call`."""
        ...

    def ordered(self, function: Callable[[Any], Result], items: Sequence[Any]) -> Iterator[Result]:
        """Yield function(item) for each item, in order, each as soon as known; `function` runs in this process."""
        ...


class InProcess:
    """Runner in the process of the caller, which hangs or ends if the tracker does."""

    def call(
        self, function: Callable[..., Result], *arguments: object, limit: Limit = NO_LIMIT, name: str = ""
    ) -> Result:
        return function(Heartbeat(limit), *arguments)

    def ordered(self, function: Callable[[Any], Result], items: Sequence[Any]) -> Iterator[Result]:
        with one_thread():
            yield from map(function, items)


class Pool(ThreadPoolExecutor):
    """Runner in a fixed number of worker processes; a worker that hangs or dies is replaced.

    As an executor it runs functions in threads of this process, one for each worker; a thread may `call` or `run`. The
    calling script needs the guard ``if __name__ == "__main__"``. The processes end with the pool, also after Ctrl-C.
    """

    def __init__(self, jobs: int) -> None:
        super().__init__(jobs)
        self._jobs = jobs
        self._workers = [Worker() for _ in range(jobs)]
        self._free: SimpleQueue[Worker] = SimpleQueue()
        for worker in self._workers:
            self._free.put(worker)

    def call(
        self, function: Callable[..., Result], *arguments: object, limit: Limit = NO_LIMIT, name: str = ""
    ) -> Result:
        """Return function(heartbeat, *arguments) from the next free worker, or raise its exception.

        A worker that dies by chance is replaced and the call repeated. TrackerLostError where the tracker at work hangs
        or kills the processes; InputError where the arguments cannot be sent to another process; WorkerError, with a
        text that begins with `name`, where workers die while no tracker is at work.
        """
        (answer,) = self.run(_call, [arguments], function, limit=limit, name=name)
        if isinstance(answer, Blame):
            raise TrackerLostError(answer, limit)
        result: Result = answer
        return result

    def run(
        self,
        function: Callable[..., Sequence[Result]],
        members: Sequence[object],
        *arguments: object,
        limit: Limit = NO_LIMIT,
        name: str = "",
    ) -> list[Result | Blame]:
        """Return function(heartbeat, members, *arguments) from a worker, a list with a result for each member.

        Members, such as trackers that share frames, run in one process; ``heartbeat.frame(index, number)`` records the
        member at work. The result of a member that hangs or kills its processes is a `Blame`, and the others run again.
        Where a process dies while no member is at work, members run one at a time, since one may have damaged the
        process. Before a member is blamed for such a crash, `function` runs once without members. Errors as in `call`.
        """
        found: dict[int, Result | Blame] = {}
        crashes, together = CrashCount(name), True
        with self._lend() as worker:
            while left := [number for number in range(len(members)) if number not in found]:
                numbers = left if together else left[:1]
                try:
                    answers = worker.call(limit, function, [members[number] for number in numbers], *arguments)
                    found |= zip(numbers, answers, strict=True)
                except NotSentError as error:
                    what = f"{name}:" if name else "the tracker"
                    raise InputError(f"{what} cannot be sent to a worker process: {error}") from None
                except WorkerDiedError as died:
                    if worker.closed:
                        raise
                    if died.member is None and len(numbers) > 1:
                        together = False
                        continue
                    blamed = crashes.add(died, limit, numbers)
                    if blamed is not None:
                        member, found[member] = blamed
                        if not blamed[1].at_work:
                            _run_without_members(worker, name, function, *arguments)
        return [found[number] for number in range(len(members))]

    def ordered(self, function: Callable[[Any], Result], items: Sequence[Any]) -> Iterator[Result]:
        """Yield function(item) for each item, in order, computed by as many threads as there are workers.

        A caller that stops early cancels the items that have not begun.
        """
        if self._jobs == 1:
            with one_thread():
                yield from map(function, items)
        else:
            yield from self.map(function, items)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = True) -> None:
        """End the processes at once, and cancel the calls that have not begun."""
        for worker in self._workers:
            worker.close()
        super().shutdown(wait, cancel_futures=cancel_futures)

    @contextmanager
    def _lend(self) -> Iterator[Worker]:
        worker = self._free.get()
        try:
            yield worker
        finally:
            self._free.put(worker)


@contextmanager
def start_runner(jobs: int, apart: bool) -> Iterator[Runner]:
    """Yield a pool of `jobs` workers, or, for one job without `apart`, the runner in this process."""
    if jobs == 1 and not apart:
        yield InProcess()
        return
    with Pool(jobs) as pool:
        yield pool


def _call(heartbeat: Heartbeat, members: Sequence[Sequence[object]], function: Callable[..., Any]) -> list[Any]:
    return [function(heartbeat, *arguments) for arguments in members]


def _run_without_members(worker: Worker, name: str, function: Callable[..., Any], *arguments: object) -> None:
    """Run the function without members; raise WorkerError where it ends processes even so."""
    crashes = CrashCount(name)
    while True:
        try:
            worker.call(NO_LIMIT, function, [], *arguments)
            return
        except WorkerDiedError as died:
            if worker.closed:
                raise
            crashes.add_unexplained(died.how)

"""Executor on the workers of a dask scheduler, on this machine or others."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from time import monotonic
from typing import Any

from irtrack.errors import InputError

WAIT_S = 10.0
"""Longest time for the scheduler to answer, for a first worker to join it, and without any worker, s."""


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Yield the workers of the scheduler at an address such as 'tcp://127.0.0.1:8786', as an executor.

    Dask reuses no result of an earlier equal task (`pure=False`): only the results file decides which runs exist.
    InputError where dask is not installed, no scheduler answers, or it has no worker.
    """
    try:
        import distributed
    except ImportError:
        raise InputError("a scheduler needs dask's distributed: pip install 'irtrack[cluster]'") from None
    client, failed = None, ""
    try:
        connect: Any = distributed.Client
        client = connect(address, timeout=WAIT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        failed = " ".join(str(error).split()) or type(error).__name__
    if client is None:
        # Raise outside of the handler, whose error keeps the incomplete client alive. Freed here, the client closes
        # now; closed later, while another client starts, it could wait forever.
        gc.collect()
        raise InputError(f"{address}: no scheduler answers: {failed}; start one: dask scheduler")
    with client:
        try:
            client.wait_for_workers(1, timeout=WAIT_S)
        except TimeoutError:
            raise InputError(f"{address}: the scheduler has no worker; start one: dask worker {address}") from None
        ended = threading.Event()
        watch = threading.Thread(target=_cancel_without_workers, args=(client, ended), daemon=True)
        watch.start()
        try:
            yield client.get_executor(pure=False)
        finally:
            ended.set()
            watch.join()


def _cancel_without_workers(client: Any, ended: threading.Event) -> None:
    """Cancel the client's tasks where the scheduler has had no worker for `WAIT_S`, until `ended` is set."""
    last = monotonic()
    while not ended.wait(WAIT_S / 10):
        if client.scheduler_info()["workers"]:
            last = monotonic()
        elif monotonic() - last > WAIT_S:
            from distributed import Future

            client.cancel([Future(key, client) for key in list(client.futures)])

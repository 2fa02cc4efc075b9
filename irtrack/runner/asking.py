"""Asking a watched process for one tracker's work until it is done, or the tracker has ended processes."""

from __future__ import annotations

from typing import Any

from irtrack.errors import InputError
from irtrack.runner.blame import Deaths
from irtrack.runner.gone import GoneError, NotSentError
from irtrack.runner.watched import Watched


def answer_or_blame(process: Watched, work: object, exceeded: str, name: str = "") -> Any:
    """What the process answers to a piece of work, or the `Blame` where the tracker hung or killed its processes.

    A process that died by chance is replaced and asked again.

    exceeded   what is said of a tracker that took too long;  name  what messages call the work

    What the work raises is raised. InputError for a tracker that cannot be sent to another process; WorkerError where
    processes die again and again before the tracker is at work; GoneError where somebody closed the process.
    """
    deaths = Deaths(name)
    while True:
        try:
            return process.ask(work)
        except NotSentError as error:
            raise InputError(f"the tracker cannot be sent to a worker process: {error}") from None
        except GoneError as gone:
            if process.closed:
                raise
            blame = deaths.blame(gone, exceeded)
            if blame is not None:
                return blame

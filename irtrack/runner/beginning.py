"""What every worker does first."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np

from irsim.render.interrupts import end_with_parent


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV uses one thread within: times are of one thread."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def begin_worker() -> None:
    """What every worker does first: one thread, and an end with its parent."""
    cv2.setNumThreads(1)
    np.random.seed()  # noqa: NPY002 - of trackers that draw from it, which all copies of the fork server share
    end_with_parent()

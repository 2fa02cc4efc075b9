"""An intent that cannot be met."""

from __future__ import annotations


class UnmetError(ValueError):
    """An intent that cannot be met: key, and why."""

    def __init__(self, key: str, why: str) -> None:
        super().__init__(why)
        self.key = key


def no_frame(index: float, frames: int) -> str:
    """Why a frame is not there, and how to render fewer without doing away with it."""
    return (
        f"there is no frame {index:g}; allowed: 0 to {frames - 1}, or more frames, of which the first {frames} can be "
        "rendered alone (stop=N)"
    )

"""Parts of a window that may hide less of what goes through it than all of the window."""

from __future__ import annotations

from collections.abc import Callable

from irsim.types import Box

THIN_PX = 1.0
"""No part is thinner."""

Part = Callable[[Box, float], Box]
"""Of a window, the part of so large a share, 1 at most. With 0 or less, of parts at its lower or right edge, what lies
below or right of it (for crowns that stick out above and aside), of others the thinnest."""


def parts(sideways: bool) -> tuple[Part, ...]:
    """Those to try, in turn: first the one along the way of a target that goes across the picture, or up or down it.

    A strip across its way hides no more of one that weaves or goes aslant, where it is narrower than the target; less
    than a strip hides what lies within a large one all the time, in both directions.
    """
    along, across = ((_right, _left, _upright), (_lower, _upper, _level)) if sideways else (
        (_lower, _upper, _level), (_right, _left, _upright)
    )  # fmt: skip
    return (*along, *reversed(across), _inner)


def whole(window: Box, share: float) -> Box:
    """All of it: for what hides less by being thinner."""
    return window


def _lower(window: Box, share: float) -> Box:
    top = window.bottom - share * window.h
    return Box.from_edges(window.left, top, window.right, max(window.bottom, top + THIN_PX))


def _right(window: Box, share: float) -> Box:
    left = window.right - share * window.w
    return Box.from_edges(left, window.top, max(window.right, left + THIN_PX), window.bottom)


def _upper(window: Box, share: float) -> Box:
    return Box.from_edges(window.left, window.top, window.right, window.top + max(share * window.h, THIN_PX))


def _left(window: Box, share: float) -> Box:
    return Box.from_edges(window.left, window.top, window.left + max(share * window.w, THIN_PX), window.bottom)


def _upright(window: Box, share: float) -> Box:
    half = max(share * window.w, THIN_PX) / 2
    return Box.from_edges(window.cx - half, window.top, window.cx + half, window.bottom)


def _level(window: Box, share: float) -> Box:
    half = max(share * window.h, THIN_PX) / 2
    return Box.from_edges(window.left, window.cy - half, window.right, window.cy + half)


def _inner(window: Box, share: float) -> Box:
    return Box(window.cx, window.cy, max(share * window.w, THIN_PX), max(share * window.h, THIN_PX))

"""How tracks show themselves in a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby

from irsim.notebook import card
from irsim.types import Floats

LOOKS = {"tracking": "#0072b2", "occluded": "#e69f00", "lost": "#d55e00"}
"""Colour of a way's part by what the tracker said there (Okabe and Ito's palette)."""

WAY_PX, WAY_HIGH_PX = 320, 240
"""The picture of the way is no wider and no higher, px."""


def track_card(name: str, facts: Mapping[str, object], centers: Floats, statuses: Sequence[str]) -> str:
    """A track: its facts, what the tracker said of itself, and its way; centers (n, 2) px, statuses n words."""
    said = ", ".join(f"{status} in {statuses.count(status)}" for status in LOOKS if status in statuses)
    return card(name, {**facts, "it says": said}, _way(centers, statuses))


def _way(centers: Floats, statuses: Sequence[str]) -> str:
    """The centres joined by lines, coloured by status, from a dot at the start."""
    low, high = centers.min(axis=0), centers.max(axis=0)
    margin = max(0.06 * float((high - low).max()), 4.0)
    (left, top), (width, height) = low - margin, high - low + 2 * margin
    lines = []
    for status, run in groupby(range(len(centers)), key=lambda k: statuses[k]):
        places = list(run)
        joined = centers[max(places[0] - 1, 0) : places[-1] + 1]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in joined)
        lines.append(f'<polyline points="{points}" stroke="{LOOKS[status]}" vector-effect="non-scaling-stroke"/>')
    x, y = centers[0]
    dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{margin / 4:.1f}" fill="{LOOKS["tracking"]}"/>'
    shown = min(WAY_PX, WAY_HIGH_PX * width / height)
    words = ", ".join(f'<span style="color: {color}">{status}</span>' for status, color in LOOKS.items())
    return (
        f'<figure style="margin: 0"><svg viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}" '
        f'style="display: block; width: {shown:.0f}px; max-width: 100%; background: rgba(128, 128, 128, .12)">'
        f'<g fill="none" stroke-width="2">{"".join(lines)}</g>{dot}</svg>'
        f'<figcaption style="font-size: 85%">its way: {words}</figcaption></figure>'
    )

"""Line styles of the trackers: colours and dash patterns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

# The six hues of Okabe and Ito's palette for all kinds of colour vision (Color Universal Design,
# 2008) that stand out on white and on black; its yellow and its black do not.
HUES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")

# Dash patterns (on and off lengths, px): further trackers repeat the hues with the next pattern.
DASHES: tuple[tuple[float, ...], ...] = ((), (6, 3), (2, 2), (8, 2, 2, 2))


@dataclass(frozen=True)
class LineStyle:
    """Colour '#rrggbb' and dash pattern, on and off lengths in px, empty for a solid line."""

    color: str
    dash: tuple[float, ...]

    @property
    def svg_dash(self) -> str:
        """Dash pattern as SVG's stroke-dasharray."""
        return " ".join(f"{length:g}" for length in self.dash) or "none"


def styles(labels: Iterable[str]) -> dict[str, LineStyle]:
    """Return a style for each label, in the given order."""
    return {
        label: LineStyle(HUES[index % len(HUES)], DASHES[index // len(HUES) % len(DASHES)])
        for index, label in enumerate(labels)
    }

"""How each tracker is drawn: one colour and one dash pattern in every table, chart and picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

# The six hues of Okabe and Ito's palette for all kinds of colour vision (Color Universal Design,
# 2008) that stand out on white and on black; its yellow and its black do not.
HUES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")

# A second set of trackers repeats the hues with the next pattern (on and off lengths, px).
DASHES: tuple[tuple[float, ...], ...] = ((), (6, 3), (2, 2), (8, 2, 2, 2))


@dataclass(frozen=True)
class LineStyle:
    """color  '#rrggbb';  dash  on and off lengths in px, empty for a solid line."""

    color: str
    dash: tuple[float, ...]

    @property
    def svg_dash(self) -> str:
        """The pattern as SVG's stroke-dasharray."""
        return " ".join(f"{length:g}" for length in self.dash) or "none"


def styles(labels: Iterable[str]) -> dict[str, LineStyle]:
    """A style for each label, in the order given."""
    return {
        label: LineStyle(HUES[index % len(HUES)], DASHES[index // len(HUES) % len(DASHES)])
        for index, label in enumerate(labels)
    }

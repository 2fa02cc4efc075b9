"""For how long, and how much of it, an occluder that is placed by whom it hides does hide it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.occluders import Occluder, Opaque
from irsim.scenario.placement_window import MARGIN_PX, STILL_PX, asked, goes_up_or_down, speed, window
from irsim.scenario.visibility import Watch
from irsim.types import Floats

LEEWAY = 0.02
"""What hides this share less than what is asked counts as hiding as much, where it is counted for how many frames; and
what hides so little of a target, well before and after, as nothing."""
LONG = 2
FEW = 4
"""It is warned of one that hides, as much as asked, in more than LONG times as many frames as are asked for (or FEW
more, where those are more), besides the frames in which its target goes by the margins on both its sides. Smoke that
takes long to grow and to fade is told of, too.

A box is hidden in the frames that are asked for and those of the margins. The rest is the target's: a body whose ends
are thin is all but hidden for long where it takes long for its own length, a tank of 73 px that goes 0.5 px a frame in
37 frames where 5 are asked."""
MUCH = 0.2
"""It is warned of one that hides so much more of the target than asked in some of the frames that are asked for."""


@dataclass(frozen=True, eq=False)
class Hold:
    """A placed occluder, and one that is the same with its intent. What it hides is told without anything nearer.

    known  (frames,) its `shares`, where they have been worked out before: in every frame, which takes long
    """

    watch: Watch
    screen: Occluder
    occluder: Occluder
    known: Floats | None = None

    @cached_property
    def shares(self) -> Floats:
        """(frames,) how much of its target it hides in each."""
        if self.known is not None:
            return self.known
        name, _ = asked(self.occluder)
        return np.array([self.watch.hidden(self.screen, name, index) for index in range(self.watch.scenario.frames)])

    @property
    def most(self) -> float:
        """The most of its target that it hides in any frame that is asked for."""
        _, (first, last) = asked(self.occluder)
        return float(self.shares[first : last + 1].max())

    @property
    def enough(self) -> float:
        """The share of its target that counts as what is asked for."""
        return self.occluder.fraction * (1 - LEEWAY)

    def outlasts(self) -> bool:
        """Does it hide the target well outside of the frames that are asked for?"""
        return self.never_ends() is not None or self.too_long() is not None

    def never_ends(self) -> str | None:
        """Why it cannot be what is asked for, where it hides the target well outside of those frames too."""
        name, (first, last) = asked(self.occluder)
        slack = self._slack()
        for index in [*range(first - slack - 1, -1, -1), *range(last + slack + 1, self.watch.scenario.frames)]:
            if self.shares[index] > LEEWAY:
                return (
                    f"what hides {name} in frames {first} to {last} hides {self.shares[index]:.2f} of it at frame "
                    f"{index} too; allowed: frames at whose ends it comes and goes, or smoke, or a place"
                )
        return None

    def too_long(self) -> str | None:
        """What is to be said where it hides the target for longer than LONG allows."""
        name, (first, last) = asked(self.occluder)
        held = np.flatnonzero(self.shares >= self.enough)
        wanted, pace = last - first + 1, speed(self.watch, self.occluder)
        margins = 2 * MARGIN_PX / pace if pace > STILL_PX else 0.0
        allowed = max(LONG * wanted, wanted + FEW) + math.ceil(margins)
        if len(held) <= allowed:
            return None
        return (
            f"it hides {self.enough:.2f} or more of {name} in frames {held[0]} to {held[-1]}, {len(held)} of them "
            f"where {wanted} are asked: {self._shorter(pace)}"
        )

    def too_much(self) -> str | None:
        """What is to be said where it hides more of the target than MUCH allows."""
        name, (first, last) = asked(self.occluder)
        fraction, shares = self.occluder.fraction, self.shares[first : last + 1]
        over = first + np.flatnonzero(shares > fraction + MUCH)
        if len(over) == 0:
            return None
        other = "" if self.occluder.translucent else ", or smoke"
        return (
            f"it hides up to {self.most:.2f} of {name} in frames {over[0]} to {over[-1]}, where {fraction:g} is "
            f"asked: try fewer frames{other}"
        )

    def _shorter(self, pace: float) -> str:
        """What makes it hide for fewer frames."""
        kind = self.occluder.kind
        if "foot_px" in self.occluder.placement_keys and goes_up_or_down(self.watch, self.occluder):
            return f"a {kind} stands on the ground; try a bar, or smoke"
        if self.occluder.translucent:
            return "try a shorter time to grow and to fade"
        other = "" if isinstance(self.occluder, Opaque) else ", a pole, which has straight sides"
        return f"it goes by at {pace:.2g} px a frame; try a faster target, one farther away{other}, or a place"

    def _slack(self) -> int:
        """Frames that it may take, before and after, until the target is out from behind it."""
        name, (first, _) = asked(self.occluder)
        pace, own = speed(self.watch, self.occluder), self.watch.sprite(name, first)
        covered, drawn = window(self.watch, self.occluder), self.screen.draw(self.watch.pose(first))
        excess = 0.0 if drawn is None else max(drawn.box.w - covered.w, drawn.box.h - covered.h, 0.0)
        size = 0.0 if own is None else own.box.diagonal
        instants = [instant.offset for instant in self.watch.instants]
        exposed = max(instants) - min(instants)
        slack = math.ceil((size + excess + 6) / pace + exposed) if pace > STILL_PX else 0
        fades = (getattr(self.screen, key, 0.0) for key in ("grow_frames", "fade_frames"))
        return slack + math.ceil(max(fades))

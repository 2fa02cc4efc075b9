"""What shipped trackers are excused from, and why: tracker -> property -> reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from irtrack.properties import contract, following, honesty, pictures
from irtrack.properties.case import Case

EXCEPTIONS: dict[str, dict[str, str]] = {
    "template": {"distractor": "it searches the whole frame, where a perfect like is as good as the target"},
}


@dataclass(frozen=True, slots=True)
class Property:
    """Something that holds of any tracker, or that its author gives a reason for.

    name      as `--only` takes it
    check     raises Broken or NotAsked; the first sentence of its docstring says what holds
    examples  how many are drawn in a check of profile ci; nightly draws `NIGHTLY` times as many. 0: nothing is drawn,
              its scenes are stated, and the profile decides how many seeds they have
    needs     properties without which it cannot be judged
    """

    name: str
    check: Callable[[Case], None]
    examples: int
    needs: tuple[str, ...] = ()

    @property
    def says(self) -> str:
        return " ".join((self.check.__doc__ or "").split("\n\n")[0].split())


EXACT = ("legal", "deterministic", "final")
"""Without these no two runs can be compared bit for bit."""

PROPERTIES: dict[str, Property] = {
    each.name: each
    for each in (
        Property("legal", contract.legal, 40),
        Property("deterministic", contract.deterministic, 2, ("legal",)),
        Property("final", contract.final, 1, ("legal", "deterministic")),
        Property("elsewhere", contract.elsewhere, 1, EXACT),
        Property("causal", contract.causal, 2, EXACT),
        Property("pure", contract.pure, 2, EXACT),
        Property("resumes", contract.resumes, 3, EXACT),
        Property("alone", contract.alone, 2, EXACT),
        Property("gentle", contract.gentle, 2),
        Property("layout", contract.layout, 2, EXACT),
        Property("timeless", contract.timeless, 2, EXACT),
        Property("bounded", contract.bounded, 1),
        Property("shift", pictures.shift, 6),
        Property("flip", pictures.flip, 6),
        Property("transpose", pictures.transpose, 6),
        Property("offset", pictures.offset, 6),
        Property("gain", pictures.gain, 6),
        Property("polarity", pictures.polarity, 4),
        Property("depth", pictures.depth, 4),
        Property("distractor", pictures.distractor, 6),
        Property("follows", following.follows, 8),
        Property("rests", following.rests, 4),
        Property("size", following.size, 6),
        Property("start_place", following.start_place, 6),
        Property("start_size", following.start_size, 6),
        Property("duplicates", following.duplicates, 6),
        Property("drops", following.drops, 6),
        Property("reacquires", following.reacquires, 4),
        Property("velocity", following.velocity, 4),
        Property("says_seen", honesty.says_seen, 0),
        Property("says_hidden", honesty.says_hidden, 0),
        Property("says_gone", honesty.says_gone, 0),
        Property("says_empty", honesty.says_empty, 0),
        Property("score", honesty.score, 0),
        Property("nees", honesty.nees, 0),
        Property("noise", honesty.noise, 0),
        Property("hiding", honesty.hiding, 0),
    )
}

"""What an experiment is made of: scenes, trackers, printed figures, claims, switches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import irsim
from irtrack.metrics import Score, Trace


@dataclass(frozen=True)
class Scene:
    """A shipped scenario with changes, under a name of its own."""

    name: str
    path: str
    overrides: tuple[str, ...] = ()

    @classmethod
    def of(cls, name: str) -> Scene:
        """The scene of the papers of that name."""
        return cls(name, f"sources/{name}")

    @property
    def siblings(self) -> tuple[Scene, Scene]:
        """The milder and the harder one."""
        return Scene.of(f"{self.name}-mild"), Scene.of(f"{self.name}-hard")

    def open(self) -> irsim.Rendering:
        return irsim.Rendering(irsim.load(self.path, self.overrides), self.name)


@dataclass(frozen=True, eq=False)
class Run:
    """One tracker's run of one seed; nothing of a run that failed."""

    score: Score
    trace: Trace


Pair = Mapping[str, Run | None]
"""The runs of one seed by the tracker's label; None where it failed."""


@dataclass(frozen=True)
class Rule:
    """What bears a claim out in one seed: in words, of which trackers, and the test.

    of gives None where the seed says nothing of it.
    """

    words: str
    labels: tuple[str, ...]
    of: Callable[[Mapping[str, Run]], bool | None]


@dataclass(frozen=True)
class Claim:
    """What a paper claims of a scene, where it stands, and the rule that tests it seed by seed."""

    text: str
    place: str
    scene: str
    rule: Rule


@dataclass(frozen=True)
class Untested:
    """What a paper claims and no run here can tell, and why."""

    text: str
    place: str
    why: str


@dataclass(frozen=True)
class Goal:
    """What a tracker here is to reach on a scene: a share of its seeds, or a mean over them.

    reach    a rule, which at least the share `wanted` of the seeds is to bear out; or a figure, px, whose mean over the
             seeds is to be at most `wanted`
    """

    text: str
    scene: Scene
    label: str
    reach: Rule | Callable[[Run], float | None]
    wanted: float


@dataclass(frozen=True)
class Printed:
    """What a paper prints of a tracker: mean and variance of |error| on each axis, px; time of a frame, ms."""

    abs_x: tuple[float, float] | None = None
    abs_y: tuple[float, float] | None = None
    ms: float | None = None


@dataclass(frozen=True)
class Experiment:
    """Trackers on a scene, by label; what the paper prints of them; where else they are run.

    charted   labels of those in the chart over frames; all where none is named
    """

    scene: Scene
    title: str
    trackers: Mapping[str, str]
    printed: Mapping[str, Printed] = field(default_factory=dict)
    remark: str = ""
    siblings: tuple[Scene, ...] = ()
    charted: tuple[str, ...] = ()

    @property
    def prints_errors(self) -> bool:
        return any(printed.abs_x for printed in self.printed.values())


@dataclass(frozen=True)
class Sweep:
    """Trackers on a scene while one setting varies, the scene's or theirs: figures of each seed's run against it.

    points   the setting to the scene and the trackers' specs by label
    log      whether setting and figures are drawn on logarithmic axes
    """

    title: str
    x: str
    points: Mapping[float, tuple[Scene, Mapping[str, str]]]
    figures: Mapping[str, Callable[[Run], float | None]]
    log: bool = False

    @property
    def labels(self) -> list[str]:
        return list(dict.fromkeys(label for _, trackers in self.points.values() for label in trackers))


@dataclass(frozen=True)
class Switch:
    """One mechanism switched off, or another in its place: both on the same scenes and seeds."""

    mechanism: str
    scene: Scene
    with_it: str
    without: str


@dataclass(frozen=True)
class Choice:
    """Of some specs the one with the fewest frames off on the development seeds of all `scenes` together."""

    scenes: tuple[Scene, ...]
    specs: tuple[str, ...]


@dataclass(frozen=True)
class Rival:
    """A switch whose other side is chosen on development seeds, then run on fresh ones."""

    mechanism: str
    scene: Scene
    with_it: str
    without: Choice


@dataclass(frozen=True)
class Paper:
    """A source with all that is repeated of it; seeds_at_most: where fewer seeds than asked for are enough."""

    key: str
    title: str
    experiments: tuple[Experiment, ...] = ()
    claims: tuple[Claim, ...] = ()
    untested: tuple[Untested, ...] = ()
    goals: tuple[Goal, ...] = ()
    sweeps: tuple[Sweep, ...] = ()
    switches: tuple[Switch, ...] = ()
    rivals: tuple[Rival, ...] = ()
    remark: str = ""
    seeds_at_most: int | None = None

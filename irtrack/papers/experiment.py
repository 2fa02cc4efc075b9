"""Parts of the reproduced experiments of a paper: scenes, trackers, figures, claims, goals, sweeps, ablations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import irsim
from irtrack.external import PEERS
from irtrack.metrics import Score, Trace
from irtrack.registry.table import TRACKERS

OF_PAPERS = (
    *("grey_pf", "cascade_pf", "product_pf", "mean_shift", "mean_shift_kalman", "mean_shift_pf"),
    *("background_restrained_pf", "template", "kalman", "ekf", "optical_flow", "camshift_kalman"),
    *("fusion_wspf", "svd_pf", "apf_tbd", "pdaf", "h_infinity", "lbp_mean_shift", "hog_pf", "adaboost_pf"),
    *("upf", "likelihood_pf", "histogram_moments", "ensemble"),
)
"""Trackers that a paper describes, names, or compares with."""

BETTER = {name: name for name in TRACKERS if name not in OF_PAPERS}
"""The other trackers of irtrack by name, for which the same goals hold."""

OURS = {name: name for name in TRACKERS} | {
    "template window": "template:window=20",
    "kalman ncc": "kalman:measurement=ncc",
    "kalman mean shift": "kalman:measurement=mean_shift",
}

CONTEXT = 3
THEIRS = {name: name for name in PEERS} | {f"{name} {CONTEXT}x": f"{name}:context={CONTEXT}" for name in PEERS}
"""External trackers, each with the tight start box and with sides CONTEXT times as long: some fail with a tight box."""


@dataclass(frozen=True)
class Scene:
    """Scene of an experiment: a shipped scenario with overrides, and its name."""

    name: str
    path: str
    overrides: tuple[str, ...] = ()

    @classmethod
    def of(cls, name: str) -> Scene:
        """Return the scene `sources/NAME`."""
        return cls(name, f"sources/{name}")

    @property
    def siblings(self) -> tuple[Scene, Scene]:
        """The milder and the harder version of the scene."""
        return Scene.of(f"{self.name}-mild"), Scene.of(f"{self.name}-hard")

    def open(self) -> irsim.Rendering:
        return irsim.Rendering(irsim.load(self.path, self.overrides), self.name)


@dataclass(frozen=True, eq=False)
class Run:
    """Score and trace of one tracker's run of one seed."""

    score: Score
    trace: Trace


@dataclass(frozen=True)
class Figure:
    """Metric of a run: its name on the page, and a function from the run to its value, None where undefined."""

    words: str
    of: Callable[[Run], float | None]


@dataclass(frozen=True)
class Rule:
    """Test of a claim with one seed, a function of the runs by label; None where the seed does not decide the claim."""

    words: str
    labels: tuple[str, ...]
    of: Callable[[Mapping[str, Run]], bool | None]


MARGIN = 0.1
"""Margin of equivalence, as a share of the control's mean; fixed before any run."""


@dataclass(frozen=True)
class PairedRule:
    """Test of a claim by the mean over the seeds of the difference in a metric between a tracker and a control.

    less      the difference is below 0
    no_worse  it is below the margin, one-sided ("does as well")
    equal     it is within the margin on both sides: two one-sided tests (Schuirmann, J. Pharmacokinet. Biopharm. 15
              (1987) 657)
    """

    figure: Figure
    label: str
    control: str
    kind: Literal["less", "no_worse", "equal"] = "less"

    @property
    def labels(self) -> tuple[str, str]:
        return self.label, self.control

    @property
    def words(self) -> str:
        form = {
            "less": "mean {} of {} below that of {}",
            "no_worse": "mean {} of {} at most {:.0%} above that of {}",
            "equal": "mean {} of {} within {:.0%} of that of {}",
        }[self.kind]
        margin = () if self.kind == "less" else (MARGIN,)
        return form.format(self.figure.words, self.label, *margin, self.control)


@dataclass(frozen=True)
class Claim:
    """Claim of a paper, its place in the paper, the scene, and the rule that tests the claim with each seed or with the
    mean over all."""

    text: str
    place: str
    scene: Scene
    rule: Rule | PairedRule


def claims(scene: Scene, *stated: tuple[str, str, Rule | PairedRule]) -> tuple[Claim, ...]:
    """Return the claims on one scene from (text, place in the paper, rule)."""
    return tuple(Claim(text, place, scene, rule) for text, place, rule in stated)


@dataclass(frozen=True)
class Untested:
    """Claim of a paper that no run here can decide, and the reason."""

    text: str
    place: str
    why: str


@dataclass(frozen=True)
class Derived:
    """Claim of a paper that is decided without a run, in closed form, and the derivation."""

    text: str
    place: str
    word: Literal["held", "not held"]
    why: str


@dataclass(frozen=True)
class Goal:
    """Goal of a tracker: a rule that must hold in at least the share `wanted` of the seeds, or a metric, px, whose mean
    over the seeds must be at most `wanted`."""

    text: str
    scene: Scene
    label: str
    reach: Rule | Figure
    wanted: float


@dataclass(frozen=True)
class Printed:
    """Printed results of a paper: mean and variance of |error| on each axis, px and px²; time per frame, ms."""

    abs_x: tuple[float, float] | None = None
    abs_y: tuple[float, float] | None = None
    ms: float | None = None


@dataclass(frozen=True)
class Experiment:
    """Experiment: trackers, by label, on a scene and its siblings; printed results; labels in the chart."""

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
    """Metrics of trackers against one setting `x`, on logarithmic axes where `log` is true.

    points    scene, and tracker specs by label, at each value of the setting
    figures   metrics by their label on the axis
    """

    title: str
    x: str
    points: Mapping[float, tuple[Scene, Mapping[str, str]]]
    figures: Mapping[str, Figure]
    log: bool = False

    @property
    def labels(self) -> list[str]:
        return list(dict.fromkeys(label for _, trackers in self.points.values() for label in trackers))


@dataclass(frozen=True)
class Choice:
    """Choice among tracker specs, by the fewest frames off target on the development seeds of all scenes."""

    scenes: tuple[Scene, ...]
    specs: tuple[str, ...]


@dataclass(frozen=True)
class Switch:
    """Ablation: a tracker with a mechanism, and without it (or with the best of a choice), on the same seeds."""

    mechanism: str
    scene: Scene
    with_it: str
    without: str | Choice


def switches(scene: Scene, *stated: tuple[str, str, str | Choice]) -> tuple[Switch, ...]:
    """Return the ablations on one scene from (mechanism, spec with it, spec without it)."""
    return tuple(Switch(mechanism, scene, with_it, without) for mechanism, with_it, without in stated)


@dataclass(frozen=True)
class Paper:
    """Experiments, claims and goals of one paper; `seeds_at_most`: number of seeds that suffices."""

    key: str
    title: str
    experiments: tuple[Experiment, ...] = ()
    claims: tuple[Claim, ...] = ()
    untested: tuple[Untested, ...] = ()
    goals: tuple[Goal, ...] = ()
    sweeps: tuple[Sweep, ...] = ()
    switches: tuple[Switch, ...] = ()
    remark: str = ""
    seeds_at_most: int | None = None
    derived: tuple[Derived, ...] = ()


HARD = tuple(
    Experiment(Scene(f"hard-{size}", f"stress/hard-{size}"), f"Targets of {size.replace('x', ' × ')} px", OURS | THEIRS)
    for size in ("14x10", "6x6", "40x28")
)
"""Experiments with low contrast, distractors, occlusion and a turn, with all trackers, external ones too."""

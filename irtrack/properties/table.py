"""Tables of the properties of each task, and the exceptions of shipped trackers: tracker -> property -> reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from irtrack.metrics.tasks import Task
from irtrack.properties import contract, detection, following, image_relations, many_targets, status_calibration
from irtrack.properties.case import Case

EXCEPTIONS: dict[str, dict[str, str]] = {
    "template": {"distractor": "it searches the whole frame, in which a perfect copy matches as well as the target"},
    "lbp_mean_shift": {"polarity": "patterns count neighbours above the middle pixel: a negative has others"},
    "svd": {"finds": "points of small frames are background to it"},
}


@dataclass(frozen=True, slots=True)
class Property:
    """Property of every tracker, with exceptions for a stated reason.

    name      name, as `--only` takes it
    check     raises Broken or NotAsked; its docstring is the statement of the property
    examples  number of examples with profile ci; nightly draws `NIGHTLY` times as many. 0: fixed scenes, with a number
              of seeds that depends on the profile
    needs     names of properties that must hold before this one can be judged
    """

    name: str
    check: Callable[[Case], None]
    examples: int
    needs: tuple[str, ...] = ()

    @property
    def says(self) -> str:
        return " ".join((self.check.__doc__ or "").split("\n\n")[0].split())


EXACT = ("legal", "deterministic", "final")
"""Properties needed to compare two runs bit for bit."""

PROPERTIES: dict[str, Property] = {
    each.name: each
    for each in (
        Property("legal", contract.valid_output, 40),
        Property("deterministic", contract.deterministic, 2, ("legal",)),
        Property("final", contract.immutable_output, 1, ("legal", "deterministic")),
        Property("elsewhere", contract.cross_process, 1, EXACT),
        Property("causal", contract.causal, 2, EXACT),
        Property("pure", contract.pure, 2, EXACT),
        Property("resumes", contract.resumes, 3, EXACT),
        Property("alone", contract.alone, 2, EXACT),
        Property("gentle", contract.readonly_input, 2),
        Property("layout", contract.memory_layout, 2, EXACT),
        Property("timeless", contract.time_invariant, 2, EXACT),
        Property("bounded", contract.bounded, 1),
        Property("shift", image_relations.shift, 6),
        Property("flip", image_relations.flip, 6),
        Property("transpose", image_relations.transpose, 6),
        Property("offset", image_relations.offset, 6),
        Property("gain", image_relations.gain, 6),
        Property("polarity", image_relations.polarity, 4),
        Property("depth", image_relations.depth, 4),
        Property("distractor", image_relations.distractor, 6),
        Property("follows", following.follows, 8),
        Property("rests", following.rests, 4),
        Property("size", following.size, 6),
        Property("start_place", following.start_place, 6),
        Property("start_size", following.start_size, 6),
        Property("duplicates", following.duplicates, 6),
        Property("drops", following.drops, 6),
        Property("reacquires", following.reacquires, 4),
        Property("velocity", following.velocity, 4),
        Property("says_seen", status_calibration.says_seen, 0),
        Property("says_hidden", status_calibration.says_hidden, 0),
        Property("says_gone", status_calibration.says_gone, 0),
        Property("says_empty", status_calibration.says_empty, 0),
        Property("score", status_calibration.score, 0),
        Property("nees", status_calibration.nees, 0),
        Property("noise", status_calibration.noise, 0),
        Property("hiding", status_calibration.hiding, 0),
    )
}
"""Properties of trackers of one target."""

_EXACT = ("legal", "deterministic")

_SHARED = {
    each.name: each
    for each in (
        Property("legal", contract.valid_output, 40),
        Property("deterministic", contract.deterministic, 2, ("legal",)),
        Property("elsewhere", contract.cross_process, 1, _EXACT),
        Property("causal", contract.causal, 2, _EXACT),
        Property("pure", contract.pure, 2, _EXACT),
        Property("resumes", contract.resumes, 2, _EXACT),
        Property("alone", contract.alone, 2, _EXACT),
        Property("gentle", contract.readonly_input, 2),
        Property("layout", contract.memory_layout, 2, _EXACT),
        Property("timeless", contract.time_invariant, 2, _EXACT),
    )
}
"""Properties of the interface, of trackers of many and of detectors: they compare the whole output of each step."""

DETECTOR_PROPERTIES: dict[str, Property] = _SHARED | {
    each.name: each
    for each in (
        Property("finds", detection.finds, 3),
        Property("shift", detection.shift, 3),
        Property("flip", detection.flip, 3),
        Property("order", detection.order, 3),
        Property("gain", detection.gain, 2),
        Property("empty", detection.empty, 4),
    )
}

MANY_PROPERTIES: dict[str, Property] = _SHARED | {
    each.name: each
    for each in (
        Property("follows", many_targets.follows, 3),
        Property("ids", many_targets.ids, 3),
        Property("order", many_targets.order, 3),
        Property("relabel", many_targets.relabel, 3),
        Property("duplicates", many_targets.duplicates, 3),
        Property("empty", many_targets.empty, 1),
        Property("crowd", many_targets.crowd, 2),
    )
}

PROPERTIES_OF: Mapping[Task, Mapping[str, Property]] = {
    "single": PROPERTIES,
    "many": MANY_PROPERTIES,
    "detect": DETECTOR_PROPERTIES,
}

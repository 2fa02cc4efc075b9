"""Program that runs peers of many targets, on detections, behind the JSON protocol.

It runs in the environment of `make peers` and imports nothing of irtrack. The protocol is that of `DetectionSession` in
`irtrack.external.json_protocol`. Run as `python many_server.py NAME`, or without a name to list the peers of this
environment. Peers count in frames and px; each has its library's own defaults where it has any:

rf_*      Roboflow trackers: IoU of boxes; a score of 1 is certain, and detectors here give scores above 1
norfair   Euclidean distance of centres up to 20 px, as in its introduction
motpy     constant velocity at 1/30 s a frame, IoU of boxes
ss_*      Stone Soup has no defaults: `STONE_SOUP`
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from datetime import datetime, timedelta
from importlib import import_module
from importlib.util import find_spec
from typing import Any, BinaryIO

MANY_PEERS = {
    "rf_sort": "trackers",
    "rf_bytetrack": "trackers",
    "rf_ocsort": "trackers",
    "norfair": "norfair",
    "motpy": "motpy",
    "ss_gnn": "stonesoup",
    "ss_jpda": "stonesoup",
}
"""Peers of many targets, and the module of each."""

STONE_SOUP = {
    "diffusion": 0.09,
    "measurement_variance": 1.0,
    "speed_variance": 4.0,
    "missed_distance": 3.0,
    "detection_probability": 0.9,
    "clutter": 3e-5,
    "hits": 4,
    "candidate_misses": 2,
    "misses": 20,
}
"""Values of Stone Soup's parts, px and frames: acceleration 0.3 px/frame^2, the rest as in irtrack's own trackers; the
gate of `ss_gnn`, in standard deviations, as in Stone Soup's tutorials."""

Row = list[Any]
"""Track: [id, x, y, w, h, score or None, status], its box by the top-left pixel."""
Boxes = list[list[float]]
"""Detections: [x, y, w, h, score] each."""
Follow = Callable[[Boxes], list[Row]]
"""Function from the detections of the next frame to the tracks."""


def serve(start: Callable[[], Follow], requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until the input ends; an exception of the peer is answered as an error."""
    follow: Follow | None = None
    while line := requests.readline():
        request = json.loads(line)
        try:
            if request["do"] == "init":
                follow = start()
            assert follow is not None, "a step before any init"
            answer: dict[str, Any] = {"tracks": follow(request["detections"])}
        except Exception as error:  # the parent reports any error of a peer
            answer = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
        answers.write(json.dumps(answer).encode() + b"\n")
        answers.flush()


def corners(boxes: Boxes) -> Any:
    """Return detections as corners (n, 4): left, top, right, bottom."""
    import numpy as np

    table = np.array(boxes, dtype=np.float64).reshape(-1, 5)
    return np.concatenate([table[:, :2], table[:, :2] + table[:, 2:4]], axis=1)


def row(id: int, box: Any, score: float | None, status: str = "tracking") -> Row:
    """Return a track of a box given by its corners."""
    left, top, right, bottom = (float(side) for side in box)
    return [id, left, top, max(right - left, 1e-3), max(bottom - top, 1e-3), score, status]


def roboflow(name: str) -> Follow:
    """Return the function of a tracker of Roboflow, which answers with the detections that have a track."""
    import numpy as np

    supervision = import_module("supervision")

    made = getattr(
        import_module("trackers"), {"sort": "SORT", "bytetrack": "ByteTrack", "ocsort": "OCSORT"}[name] + "Tracker"
    )()

    def follow(boxes: Boxes) -> list[Row]:
        scores = np.array([each[4] for each in boxes], dtype=np.float64)
        given = supervision.Detections(corners(boxes), confidence=scores, class_id=np.zeros(len(boxes), int))
        found = made.update(given)
        scores = found.confidence if found.confidence is not None else np.ones(len(found))
        triples = zip(found.tracker_id.tolist(), found.xyxy, scores.tolist(), strict=True)
        return [row(id, box, score) for id, box, score in triples if id >= 0]

    return follow


def norfair() -> Follow:
    """Return the function of Norfair, which follows the centres; a track's size and score are its last detection's."""
    import numpy as np

    library = import_module("norfair")
    tracker = library.Tracker(distance_function="euclidean", distance_threshold=20)

    def follow(boxes: Boxes) -> list[Row]:
        given = [
            library.Detection(np.array([[x + w / 2, y + h / 2]]), data=(w, h, score)) for x, y, w, h, score in boxes
        ]
        rows = []
        for each in tracker.update(given):
            (x, y), (w, h, score) = each.estimate[0], each.last_detection.data
            seen = each.last_detection.age == each.age
            box = (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
            rows.append(row(int(each.id), box, score, "tracking" if seen else "occluded"))
        return rows

    return follow


def motpy() -> Follow:
    """Return the function of motpy."""
    library = import_module("motpy")
    tracker = library.MultiObjectTracker(dt=1 / 30)
    numbers: dict[str, int] = {}

    def follow(boxes: Boxes) -> list[Row]:
        tracker.step([library.Detection(box, each[4]) for box, each in zip(corners(boxes), boxes, strict=True)])
        stale = {each.id for each in tracker.trackers if each.staleness > 0}
        return [
            row(
                numbers.setdefault(each.id, len(numbers)),
                each.box,
                float(each.score),
                "occluded" if each.id in stale else "tracking",
            )
            for each in tracker.active_tracks()
        ]

    return follow


def stone_soup(method: str) -> Follow:
    """Return the function of a Kalman filter with nearest neighbours (`gnn`) or joint probabilities (`jpda`).

    Joint probabilities by loopy belief propagation: Stone Soup's exact ones would list 2^40 events for 40 isolated
    targets.
    """
    import numpy as np

    GNNWith2DAssignment = import_module("stonesoup.dataassociator.neighbour").GNNWith2DAssignment
    JPDAwithLBP = import_module("stonesoup.dataassociator.probability").JPDAwithLBP
    UpdateTimeStepsDeleter = import_module("stonesoup.deleter.time").UpdateTimeStepsDeleter
    DistanceHypothesiser = import_module("stonesoup.hypothesiser.distance").DistanceHypothesiser
    PDAHypothesiser = import_module("stonesoup.hypothesiser.probability").PDAHypothesiser
    MultiMeasurementInitiator = import_module("stonesoup.initiator.simple").MultiMeasurementInitiator
    Mahalanobis = import_module("stonesoup.measures").Mahalanobis
    LinearGaussian = import_module("stonesoup.models.measurement.linear").LinearGaussian
    CombinedLinearGaussianTransitionModel = import_module(
        "stonesoup.models.transition.linear"
    ).CombinedLinearGaussianTransitionModel
    ConstantVelocity = import_module("stonesoup.models.transition.linear").ConstantVelocity
    KalmanPredictor = import_module("stonesoup.predictor.kalman").KalmanPredictor
    MultiTargetMixtureTracker = import_module("stonesoup.tracker.simple").MultiTargetMixtureTracker
    MultiTargetTracker = import_module("stonesoup.tracker.simple").MultiTargetTracker
    Detection = import_module("stonesoup.types.detection").Detection
    GaussianState = import_module("stonesoup.types.state").GaussianState
    Update = import_module("stonesoup.types.update").Update
    KalmanUpdater = import_module("stonesoup.updater.kalman").KalmanUpdater

    keys = STONE_SOUP
    axis = ConstantVelocity(keys["diffusion"])
    predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
    model = LinearGaussian(4, (0, 2), np.eye(2) * keys["measurement_variance"])
    updater = KalmanUpdater(model)
    nearest = GNNWith2DAssignment(
        DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=keys["missed_distance"])
    )
    prior = GaussianState([[0], [0], [0], [0]], np.diag([1, keys["speed_variance"]] * 2))
    starts = MultiMeasurementInitiator(
        prior,
        UpdateTimeStepsDeleter(int(keys["candidate_misses"])),
        nearest,
        updater,
        model,
        min_points=int(keys["hits"]),
    )
    frames: list[tuple[datetime, set[Any]]] = []

    def coming() -> Any:
        while True:
            yield frames.pop()

    common = (starts, UpdateTimeStepsDeleter(int(keys["misses"])), coming())
    if method == "gnn":
        tracker = MultiTargetTracker(*common, nearest, updater)
    else:
        probability = PDAHypothesiser(
            predictor, updater, clutter_spatial_density=keys["clutter"], prob_detect=keys["detection_probability"]
        )
        tracker = MultiTargetMixtureTracker(*common, JPDAwithLBP(probability), updater)
    steps, count = iter(tracker), 0
    numbers: dict[str, int] = {}
    sizes: dict[str, dict[str, Any]] = {}
    epoch = datetime(2000, 1, 1)

    def follow(boxes: Boxes) -> list[Row]:
        nonlocal count
        count += 1  # one second stands for one frame
        when = epoch + timedelta(seconds=count)
        given = {
            Detection(
                [[x + w / 2], [y + h / 2]],
                timestamp=when,
                measurement_model=model,
                metadata={"size": (w, h), "score": score},
            )
            for x, y, w, h, score in boxes
        }
        frames.append((when, given))
        _, found = next(steps)
        rows = []
        for each in sorted(found, key=lambda track: tuple(track.state_vector.ravel())):  # a set has no order
            hit = isinstance(each[-1], Update)
            if hit:
                of = each[-1].hypothesis  # a joint update has a hypothesis for each of several detections
                best = of if hasattr(of, "measurement") else max(filter(None, of), key=lambda one: one.probability)
                sizes[each.id] = best.measurement.metadata
            x, y = float(each.state_vector[0, 0]), float(each.state_vector[2, 0])
            last = sizes.get(each.id, {"size": (5.0, 5.0), "score": None})
            w, h = last["size"]
            box = (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
            number = numbers.setdefault(each.id, len(numbers))
            rows.append(row(number, box, last["score"], "tracking" if hit else "occluded"))
        return rows

    return follow


def start(name: str) -> Follow:
    """Return the function of a peer, newly started; raise an exception where this environment lacks the peer."""
    family, _, method = name.partition("_")
    if family == "rf":
        return roboflow(method)
    if family == "ss":
        return stone_soup(method)
    return norfair() if name == "norfair" else motpy()


def main(names: list[str]) -> None:
    # Libraries print to standard output, so answers go to a copy of it made before it is redirected.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    if names:
        name = names[0]
        start(name)  # libraries are imported, and warn, before the first request
        serve(lambda: start(name), sys.stdin.buffer, answers)
    else:
        answers.write(json.dumps([name for name, module in MANY_PEERS.items() if find_spec(module)]).encode() + b"\n")
        answers.flush()


if __name__ == "__main__":
    main(sys.argv[1:])

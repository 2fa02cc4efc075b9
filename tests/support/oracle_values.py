"""Values of other implementations on the cases of `oracle_cases`, as JSON: run by .venv-oracles (`make oracles`).

.venv-oracles/bin/python tests/support/oracle_values.py COUNT > VALUES.json
"""

from __future__ import annotations

import json
import sys
from datetime import datetime, timedelta
from typing import Any

import numpy as np
from oracle_cases import (
    bearing_target,
    masks,
    one_gate,
    sequence,
    shared_gates,
    straight_target,
    turning_target,
    two_classes,
)


def of_trackeval(seed: int) -> dict[str, float]:
    """Return HOTA, CLEAR MOT and identity figures by trackeval."""
    from trackeval.metrics import CLEAR, HOTA, Identity

    frames = sequence(seed)
    targets = {each: i for i, each in enumerate(sorted({t for row, _, _ in frames for t in row.tolist()}))}
    tracks = {each: i for i, each in enumerate(sorted({r for _, row, _ in frames for r in row.tolist()}))}
    data = {
        "num_timesteps": len(frames),
        "num_gt_ids": len(targets),
        "num_tracker_ids": len(tracks),
        "num_gt_dets": sum(len(t) for t, _, _ in frames),
        "num_tracker_dets": sum(len(r) for _, r, _ in frames),
        "gt_ids": [np.array([targets[t] for t in row.tolist()], dtype=int) for row, _, _ in frames],
        "tracker_ids": [np.array([tracks[r] for r in row.tolist()], dtype=int) for _, row, _ in frames],
        "similarity_scores": [similarity for _, _, similarity in frames],
    }
    hota = HOTA().eval_sequence(data)
    clear = CLEAR({"PRINT_CONFIG": False}).eval_sequence(data)
    identity = Identity({"PRINT_CONFIG": False}).eval_sequence(data)
    return {
        "hota": float(np.mean(hota["HOTA"])),
        "deta": float(np.mean(hota["DetA"])),
        "assa": float(np.mean(hota["AssA"])),
        "mota": float(clear["MOTA"]),
        "switches": int(clear["IDSW"]),
        "fragments": int(clear["Frag"]),
        "misses": int(clear["CLR_FN"]),
        "false": int(clear["CLR_FP"]),
        "idf1": float(identity["IDF1"]),
    }


def of_pyirstdmetrics(seed: int) -> dict[str, float]:
    """Return Pd and Fa by both published rules, IoU and nIoU, by pyirstdmetrics."""
    import py_irstd_metrics as theirs

    centroids = theirs.ProbabilityDetectionAndFalseAlarmRate()
    shooting = theirs.ShootingRuleBasedProbabilityDetectionAndFalseAlarmRate()
    pixels = theirs.CMMetrics(num_bins=1, threshold=0.5)
    pixels.add_handler("iou", theirs.IoUHandler(with_dynamic=False, with_binary=True, sample_based=False))
    pixels.add_handler("niou", theirs.IoUHandler(with_dynamic=False, with_binary=True, sample_based=True))
    for prediction, truth in masks(seed):
        centroids.update(prediction, truth)
        shooting.update(prediction, truth)
        pixels.update(prediction, truth)
    first, second, third = centroids.get(), shooting.get(), pixels.get()
    return {
        "pd": float(np.ravel(first["probability_detection"])[0]),
        "fa": float(np.ravel(first["false_alarm"])[0]),
        "shooting_pd": float(np.ravel(second["probability_detection"])[0]),
        "shooting_fa": float(np.ravel(second["false_alarm"])[0]),
        "iou": float(third["iou"]["binary"]),
        "niou": float(third["niou"]["binary"]),
    }


def of_filterpy(seed: int) -> dict[str, Any]:
    """Return places (20, 2) and probabilities of models (20, 3) by filterpy's IMM; state x, y, vx, vy."""
    from filterpy.kalman import IMMEstimator, KalmanFilter

    case = turning_target(seed)
    filters = []
    for rate in (0.0, case["rate"], -case["rate"]):
        one = KalmanFilter(dim_x=4, dim_z=2)
        s, c = np.sin(rate), np.cos(rate)
        along, across = (s / rate, (1 - c) / rate) if rate else (1.0, 0.0)
        one.F = np.array([[1, 0, along, -across], [0, 1, across, along], [0, 0, c, -s], [0, 0, s, c]])
        one.H = np.eye(2, 4)
        gain = np.array([[0.5, 0], [0, 0.5], [1, 0], [0, 1]])
        one.Q = case["acceleration"] ** 2 * gain @ gain.T
        one.R = np.eye(2)
        one.x = np.array([*case["detections"][0], 0, 0])
        one.P = np.diag([1.0, 1.0, 4.0, 4.0])
        filters.append(one)
    stay = case["stay"]
    switching = np.full((3, 3), (1 - stay) / 2) + np.eye(3) * (stay - (1 - stay) / 2)
    bank = IMMEstimator(filters, np.full(3, 1 / 3), switching)
    places, models = [], []
    for detection in case["detections"][1:]:
        bank.predict()
        bank.update(detection)
        places.append(np.ravel(bank.x)[:2].tolist())
        models.append(np.ravel(bank.mu).tolist())
    return {"places": places, "models": models}


def of_stonesoup(seed: int) -> dict[str, Any]:
    """Return joint probabilities (n, m) by Stone Soup's JPDA: P_D .9, no gate, 0.01 clutter per px^2."""
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, RandomWalk
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater

    case, now = shared_gates(seed), datetime(2026, 1, 1)
    model = LinearGaussian(2, (0, 1), np.eye(2))
    still = CombinedLinearGaussianTransitionModel([RandomWalk(0.0), RandomWalk(0.0)])
    hypothesiser = PDAHypothesiser(
        KalmanPredictor(still), KalmanUpdater(model), clutter_spatial_density=0.01, prob_detect=0.9, prob_gate=1 - 1e-12
    )
    tracks = [
        Track([GaussianState(center[:, None], variance * np.eye(2), now)])
        for center, variance in zip(case["centers"], case["variances"], strict=True)
    ]
    later = now + timedelta(seconds=1)
    plots = [Detection(each[:, None], timestamp=later, measurement_model=model) for each in case["detections"]]
    found = JPDA(hypothesiser).associate(tracks, set(plots), later)
    beta = np.zeros((len(tracks), len(plots)))
    for row, track in enumerate(tracks):
        for hypothesis in found[track]:
            if hypothesis:
                beta[row, next(k for k, plot in enumerate(plots) if plot is hypothesis.measurement)] = float(
                    hypothesis.probability
                )
    return {"beta": beta.tolist()}


def of_stonesoup_pda(seed: int) -> dict[str, Any]:
    """Return probabilities (m,) by Stone Soup's PDA of one track, without a gate."""
    from stonesoup.dataassociator.probability import PDA
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, RandomWalk
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater

    case, now = one_gate(seed), datetime(2026, 1, 1)
    model = LinearGaussian(2, (0, 1), np.eye(2))
    still = CombinedLinearGaussianTransitionModel([RandomWalk(0.0), RandomWalk(0.0)])
    hypothesiser = PDAHypothesiser(
        KalmanPredictor(still),
        KalmanUpdater(model),
        clutter_spatial_density=case["clutter"],
        prob_detect=case["detection_probability"],
        prob_gate=1 - 1e-12,
    )
    track = Track([GaussianState(case["center"][:, None], case["covariance"], now)])
    later = now + timedelta(seconds=1)
    plots = [Detection(each[:, None], timestamp=later, measurement_model=model) for each in case["detections"]]
    beta = [0.0] * len(plots)
    for hypothesis in PDA(hypothesiser).associate({track}, set(plots), later)[track]:
        if hypothesis:
            beta[next(k for k, plot in enumerate(plots) if plot is hypothesis.measurement)] = float(
                hypothesis.probability
            )
    return {"beta": beta}


def of_filterpy_hinfinity(seed: int) -> dict[str, Any]:
    """Return predicted states (19, 4) by filterpy's H-infinity filter, whose update gives the next prediction's gain.

    Its Q is the weight S of the errors, its W the process noise; its mean lacks the transition, which is added here.
    """
    from filterpy.hinfinity import HInfinityFilter

    case = straight_target(seed)
    one = HInfinityFilter(dim_x=4, dim_z=2, dim_u=0, gamma=case["theta"])
    one.F = np.array([[1.0, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    one.H = np.eye(2, 4)
    gain = np.array([[0.5, 0], [0, 0.5], [1, 0], [0, 1]])
    one.W = case["acceleration"] ** 2 * gain @ gain.T
    one.Q = np.eye(4)
    one.V = case["measurement_sd"] ** 2 * np.eye(2)
    one.P = np.diag([4.0, 4.0, 9.0, 9.0])
    one.x = np.array([[*case["detections"][0], 0.0, 0.0]]).T
    states = []
    for detection in case["detections"][1:]:
        moved = one.F @ one.x
        one.update(detection[:, None])  # x + K nu with K = F P L H' V^-1
        one.x = moved + one.x - np.linalg.solve(one.F, moved)
        states.append(np.ravel(one.x).tolist())
    return {"states": states}


def of_sklearn(seed: int) -> dict[str, Any]:
    """Return the linear SVM, Platt's probability of its margins, and AdaBoost on trees of depth 1, by scikit-learn."""
    from sklearn.calibration import _sigmoid_calibration
    from sklearn.ensemble import AdaBoostClassifier
    from sklearn.svm import LinearSVC
    from sklearn.tree import DecisionTreeClassifier

    case = two_classes(seed)
    x, y = case["vectors"], case["positive"]
    svm = LinearSVC(C=case["cost"], dual=False, tol=1e-12, max_iter=100_000).fit(x, y)
    margins = svm.decision_function(x)
    a, c = _sigmoid_calibration(margins, y)
    boosted = AdaBoostClassifier(DecisionTreeClassifier(max_depth=1), n_estimators=case["rounds"], random_state=0)
    boosted.fit(x, y)
    return {
        "margins": margins.tolist(),
        "a": -float(a),
        "c": -float(c),
        "decisions": boosted.predict(x).tolist(),
        "alpha": (boosted.estimator_weights_ / 2).tolist(),
    }


def of_filterpy_points(seed: int) -> dict[str, Any]:
    """Return states (10, 4) of filterpy's Kalman (of places), extended and unscented filter; sigma points at the
    start. The unscented filter's points are drawn anew from each prediction."""
    from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

    case = bearing_target(seed)

    def measured(x: np.ndarray) -> np.ndarray:
        flat = np.ravel(x)
        return np.array([np.hypot(flat[0], flat[1]), np.arctan2(flat[1], flat[0])])

    def slope(x: np.ndarray) -> np.ndarray:
        a, b = np.ravel(x)[:2]
        r = np.hypot(a, b)
        return np.array([[a / r, b / r, 0, 0], [-b / r**2, a / r**2, 0, 0]])

    sigmas = MerweScaledSigmaPoints(4, alpha=0.5, beta=2.0, kappa=0.0)
    kalman, extended = KalmanFilter(dim_x=4, dim_z=2), ExtendedKalmanFilter(dim_x=4, dim_z=2)
    unscented = UnscentedKalmanFilter(dim_x=4, dim_z=2, dt=1, hx=measured, fx=lambda x, dt: x, points=sigmas)
    F = np.array([[1.0, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    Q = case["acceleration"] ** 2 * np.kron(np.array([[1 / 3, 1 / 2], [1 / 2, 1]]), np.eye(2))
    for one in (kalman, extended, unscented):
        one.x, one.P = case["start"].copy(), np.diag(case["sds"] ** 2)
        one.R = np.diag([case["range_sd"] ** 2, case["bearing_sd"] ** 2])
    kalman.H, kalman.R = np.eye(2, 4), case["range_sd"] ** 2 * np.eye(2)
    found: dict[str, Any] = {"kf": [], "ekf": [], "ukf": []}
    found["sigmas"] = sigmas.sigma_points(case["start"], np.diag(case["sds"] ** 2)).tolist()
    for z in case["plots"]:
        for one in (kalman, extended, unscented):
            one.x, one.P = F @ one.x, F @ one.P @ F.T + Q
        kalman.update(z[0] * np.array([np.cos(z[1]), np.sin(z[1])]))
        extended.update(z, slope, measured)
        unscented.sigmas_f = sigmas.sigma_points(unscented.x, unscented.P)
        unscented.update(z)
        for name, one in (("kf", kalman), ("ekf", extended), ("ukf", unscented)):
            found[name].append(np.ravel(one.x).tolist())
    return found


ORACLES = {
    "trackeval": of_trackeval,
    "pyirstdmetrics": of_pyirstdmetrics,
    "filterpy": of_filterpy,
    "stonesoup": of_stonesoup,
    "stonesoup_pda": of_stonesoup_pda,
    "filterpy_hinfinity": of_filterpy_hinfinity,
    "sklearn": of_sklearn,
    "filterpy_points": of_filterpy_points,
}

if __name__ == "__main__":
    count = int(sys.argv[1])
    values = {name: [of(seed) for seed in range(count)] for name, of in ORACLES.items()}
    json.dump(values, sys.stdout)

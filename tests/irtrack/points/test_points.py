"""Filters of points: filterpy and the Kalman filter, the posterior bound, tabu search, and one contract for all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle_cases import bearing_target
from oracles import values_of

import irsim
from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.filters.multiple_model import singer_model
from irtrack.filters.unscented import sigma_points, sigma_weights
from irtrack.points import FILTERS, GaussianFilter, Observer, PointPF, PointSensor, World, filter_of
from irtrack.points.bound import posterior_bound
from irtrack.points.motion import TURNS, Motion
from irtrack.points.tabu import Accept, Tabu, search
from irtrack.points.world import Draws, simulated, target_places

STRAIGHT = Motion(acceleration=0.6)


def world_of(sensor: PointSensor, runs: int = 6, steps: int = 20, first: int = 0) -> World:
    """Straight targets of the model `STRAIGHT`, whose first state has the errors that the filters assume."""
    seeds = range(first, first + runs)
    start = np.tile([100.0, 60, 1, 0.5], (runs, 1))
    states = simulated(STRAIGHT.bank(("cv",)), np.zeros(steps - 1, int), start, seeds)
    path = Observer(velocity=(0.5, 0), weave=10)
    return World.of(states[..., :2], sensor, path, seeds, start_sd=(2, 0.5), velocities=states[..., 2:])


@pytest.mark.parametrize("seed", range(len(values_of("filterpy_points"))))
def test_states_equal_filterpy(seed: int) -> None:
    case, theirs = bearing_target(seed), values_of("filterpy_points")[seed]
    sensor = PointSensor(range_sd=case["range_sd"], bearing_sd=case["bearing_sd"], glint=0)
    motion = Motion(acceleration=case["acceleration"])
    places = case["plots"][:, :1] * np.stack([np.cos(case["plots"][:, 1]), np.sin(case["plots"][:, 1])], axis=1)
    start, sds = case["start"], case["sds"]
    for name in ("kf", "ekf", "ukf"):
        own = sensor.model_copy(update={"kind": "position"}) if name == "kf" else sensor
        z = places if name == "kf" else case["plots"]
        plots = np.concatenate([z[:1], z])[None, :, None]
        world = World(np.zeros((1, 11, 4)), np.zeros((11, 2)), plots, own, (0,), start[None], sds)
        found = filter_of(name, motion).run(world).mean[0, 1:]
        np.testing.assert_allclose(found, theirs[name], rtol=1e-9, atol=1e-9)
    points = sigma_points(start, np.diag(sds**2))
    np.testing.assert_allclose(points, theirs["sigmas"], rtol=1e-12, atol=1e-12)
    of_mean, of_covariance = sigma_weights(4)
    np.testing.assert_allclose(of_mean @ points, start, atol=1e-10)
    apart = points - start
    np.testing.assert_allclose((apart.T * of_covariance) @ apart, np.diag(sds**2), atol=1e-10)


@pytest.mark.parametrize("name", ["bootstrap", "auxiliary", "weight_selected", "ekf_pf", "ukf_pf"])
def test_particles_of_a_linear_model_agree_with_the_kalman_filter(name: str) -> None:
    """Places with normal noise: with 1,000 particles the estimate is within .3 of the posterior deviation, and nearer
    than with 100."""
    world = world_of(PointSensor(kind="position", glint=0), runs=5)
    kalman = filter_of("kf", STRAIGHT).run(world)
    spread = np.sqrt(np.trace(kalman.covariance[:, 5:, :2, :2], axis1=2, axis2=3)).mean()
    apart = []
    for n in (100, 1000):
        pf = replace(FILTERS[name], particles=n, motion=STRAIGHT)  # type: ignore[arg-type]  # all are particle filters
        apart.append(np.sqrt(((pf.run(world).mean - kalman.mean)[:, 5:, :2] ** 2).sum(axis=2).mean()) / spread)
    assert apart[1] < min(0.3, 0.75 * apart[0])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["position", "range_bearing"])
def test_likelihood_filter_has_the_posterior_mean_of_the_bootstrap_filter(kind: str) -> None:
    """With 100,000 particles, with glint; its effective sample size is smaller (Li, Li 2014, section 1)."""
    world = world_of(PointSensor(kind=kind, glint=0.1), runs=2, steps=8)  # type: ignore[arg-type]  # one of the kinds
    bootstrap, likelihood = (
        replace(FILTERS[name], particles=100_000, motion=STRAIGHT).run(world)  # type: ignore[arg-type]
        for name in ("bootstrap", "likelihood")
    )
    spread = np.sqrt(np.trace(bootstrap.covariance[:, 1:, :2, :2], axis1=2, axis2=3))
    apart = np.sqrt(((likelihood.mean - bootstrap.mean)[:, 1:, :2] ** 2).sum(axis=2)) / spread
    assert apart.max() < 0.2
    assert likelihood.neff[:, 1:].mean() < 0.3 * bootstrap.neff[:, 1:].mean()


def test_single_mode_keeps_the_posterior_bound() -> None:
    """One mode: no filter is below the bound, and the extended filter is within a third of it without glint. With
    glint the mixture tells more than a normal of equal variance."""
    for glint in (0.0, 0.1):
        sensor = PointSensor(glint=glint)
        world = world_of(sensor, runs=100, steps=15)
        bound = posterior_bound(world, STRAIGHT.bank(("cv",)).models[0])[5:]
        names = ("ekf", "ukf") if glint == 0 else ("ekf", "ekf_pf")
        for name in names:
            found = filter_of(name, STRAIGHT).run(world)
            squares = ((found.mean - world.states)[:, 5:, :2] ** 2).sum(axis=2)
            rmse = np.sqrt(squares.mean())
            error = squares.mean(axis=1).std() / np.sqrt(len(squares)) / (2 * rmse)
            assert rmse > np.sqrt((bound**2).mean()) - 3 * error
            if glint == 0:
                assert rmse < 1.33 * np.sqrt((bound**2).mean())
    assert sensor.glint_information > 5 / sensor.matched_factor
    assert PointSensor(glint=0).glint_information == pytest.approx(1, abs=1e-3)
    assert PointSensor(kind="bearing", glint=0).glint_information == pytest.approx(1, abs=1e-3)


def test_likelihood_integrates_to_one_over_plots() -> None:
    """(1 - epsilon) N + epsilon N(0, c R) over a fine grid of bearings; and the mixture with missed and false plots by
    hand."""
    sensor = PointSensor(kind="bearing", glint=0.2, bearing_sd=0.01)
    z = np.linspace(-1, 1, 40_001)
    density = np.exp(sensor.log_likelihood(z[:, None, None], np.broadcast_to([50.0, 0.0], (len(z), 1, 2))))[:, 0]
    assert np.trapezoid(density, z) == pytest.approx(1, abs=1e-3)
    sensor = PointSensor(kind="bearing", glint=0, bearing_sd=0.1, detection_probability=0.8, false_plots=2)
    plots = np.array([[[0.05], [1.0], [np.nan]], [[np.nan], [np.nan], [np.nan]]])
    found = np.exp(sensor.log_likelihood(plots, np.array([[[9.0, 0.0]], [[9.0, 0.0]]])))
    normal = np.exp(-0.5 * np.array([0.5, 10.0]) ** 2) / (0.1 * np.sqrt(2 * np.pi))
    assert found[0, 0] == pytest.approx(0.2 * 2 / (2 * np.pi) + 0.8 * normal.sum())
    assert found[1, 0] == 1


def test_plots_have_the_stated_rates_and_noise() -> None:
    sensor = PointSensor(detection_probability=0.7, false_plots=1.5, glint=0.1)
    world = world_of(sensor, runs=60, steps=50)
    there = ~np.isnan(world.plots[..., 0])
    assert there.sum(axis=2).mean() == pytest.approx(0.7 + 1.5, abs=4 * np.sqrt((0.21 + 1.5) / 3000))
    world = world_of(PointSensor(glint=0.1), runs=60, steps=50)
    noise = sensor.residual(world.plots[:, :, 0], sensor.measured(world.states[..., :2] - world.observer))
    scaled = (noise**2 / sensor.variances).mean()
    assert scaled == pytest.approx(sensor.matched_factor, rel=0.25)
    assert (np.abs(noise / np.sqrt(sensor.variances)) > 3).mean() == pytest.approx(0.1 * 0.764, abs=0.02)


def test_singer_model_between_its_limits() -> None:
    """The decay is exp(-rate); Q equals the sum of small steps of the differential equation."""
    model, small = singer_model(0.5, 0.3), singer_model(0.5, 0.3 / 1000)
    assert model.F[4, 4] == pytest.approx(np.exp(-0.3))
    assert small.F[0, 4] == pytest.approx(0.5, rel=1e-3)
    A = np.array([[0, 1, 0], [0, 0, 1], [0, 0, -0.3]]) / 2000
    F, Q = np.eye(3) + A + A @ A / 2, np.zeros((3, 3))
    for _ in range(2000):
        Q = F @ Q @ F.T + np.diag([0, 0, 2 * 0.3 * 0.25 / 2000])
    np.testing.assert_allclose(model.Q[::2, ::2], Q, rtol=5e-3)
    np.testing.assert_allclose(model.Q[1::2, 1::2], Q, rtol=5e-3)


def test_tabu_search_by_hand() -> None:
    """One candidate within the particle's own cell: tabu unless it is the best of all; a candidate elsewhere is
    taken if it is better."""
    draws = Draws((0,), "test")
    roots = np.zeros((1, 1, 4, 4))

    def score(x: Floats) -> Floats:
        found: Floats = -np.abs(x[..., 0] - 1.0)
        return found

    x = np.array([[[0.0, 0, 0, 0]]])
    still, gain = search(x, roots, score, np.zeros((1, 1)), Tabu(rounds=3), draws)
    assert still.tolist() == x.tolist()
    assert gain.tolist() == [[0.0]]
    roots[..., 0, 0] = 1.0
    moved, gain = search(x, roots, score, np.zeros((1, 1)), Tabu(rounds=20, cell=1e-3), draws)
    assert gain[0, 0] > 0.5
    assert abs(moved[0, 0, 0] - 1) < 0.5
    held, gain = search(x, roots, score, np.ones((1, 1)), Tabu(rounds=20, cell=100.0), draws)
    places = held[0, 0, 0], gain[0, 0]
    assert places == (0.0, 0.0) or held[0, 0, 0] < 0  # a cell of 100 px: only the neighbouring one may be entered


def test_metropolis_moves_keep_the_posterior_and_greedy_ones_do_not() -> None:
    """A linear model: the variance of the particles after the moves equals the Kalman filter's, or falls below it."""
    world = world_of(PointSensor(kind="position", glint=0), runs=15, steps=10)
    kalman = filter_of("kf", STRAIGHT).run(world)
    wanted = np.trace(kalman.covariance[:, 4:, :2, :2], axis1=2, axis2=3).mean()
    shares = {}
    accepts: tuple[Accept, ...] = ("off", "metropolis", "greedy")
    for accept in accepts:
        tabu = Tabu(accept, share=1.0, rounds=6)
        pf = PointPF(particles=200, proposal="extended", tabu=tabu, motion=STRAIGHT)
        shares[accept] = np.trace(pf.run(world).covariance[:, 4:, :2, :2], axis1=2, axis2=3).mean() / wanted
    assert shares["off"] == pytest.approx(1, abs=0.1)
    assert shares["metropolis"] == pytest.approx(1, abs=0.1)
    assert shares["greedy"] < 0.9


SENSORS = {
    "bearing": PointSensor(kind="bearing"),
    "range_bearing": PointSensor(detection_probability=0.9, false_plots=0.5),
    "position": PointSensor(kind="position", glint=0.05),
}


@pytest.mark.parametrize("kind", SENSORS)
@pytest.mark.parametrize("name", FILTERS)
def test_contract_of_every_filter(name: str, kind: str) -> None:
    """Finite estimates, positive covariances, equal for equal seeds, and equal for a run alone."""
    world, filter = world_of(SENSORS[kind], runs=3, steps=8), filter_of(name, Motion())
    if kind == "bearing" and filter.needs_range:
        with pytest.raises(InputError, match="allowed: range_bearing, position"):
            filter.run(world)
        return
    before = world.plots.copy(), world.start.copy()
    found = filter.run(world)
    assert np.isfinite(found.mean).all()
    assert np.linalg.eigvalsh(found.covariance).min() > 0
    assert np.array_equal(found.mean, filter.run(world).mean)
    alone = filter.run(world.runs(slice(2, 3)))
    np.testing.assert_allclose(alone.mean[0], found.mean[2], rtol=1e-9, atol=1e-9)
    if isinstance(filter, PointPF):
        assert (found.neff >= 1 - 1e-9).all()
        assert (found.neff <= filter.particles + 1e-9).all()
    assert np.array_equal(before[0], world.plots, equal_nan=True)
    assert np.array_equal(before[1], world.start)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", FILTERS)
def test_status_and_covariance_under_bad_input(name: str) -> None:
    """No plot for long: lost, with a covariance that grows. Plots far from all particles: finite. A start without any
    error: finite. All false plots: lost."""
    world, filter = world_of(PointSensor(detection_probability=0.9, false_plots=0.5), runs=2, steps=40), FILTERS[name]
    quiet = world.plots.copy()
    quiet[:, 10:] = np.nan
    blind = replace(world, plots=quiet)
    found = filter.run(blind)
    assert (found.statuses(blind)[:, -1] == "lost").all()
    assert (found.statuses(blind)[:, 12] == "occluded").all()
    sizes = np.trace(found.covariance[..., :2, :2], axis1=2, axis2=3)
    assert (sizes[:, -1] > 4 * sizes[:, 9]).all()
    apart = world.plots.copy()
    apart[:, 20:, :, 0] += 1e5
    for bad in (replace(world, plots=apart), replace(world, start_sd=np.full(4, 1e-9))):
        found = filter.run(bad)
        assert np.isfinite(found.mean).all()
        assert np.linalg.eigvalsh(found.covariance).min() > -1e-9
    assert (filter.run(replace(world, plots=apart)).statuses(replace(world, plots=apart))[:, 20] != "tracking").all()


def test_targets_of_scenarios_are_a_world() -> None:
    source = irsim.Rendering(irsim.load("stress/scr", ("frames=12",)), "scr")
    places = target_places(source)
    assert places.shape == (12, 2)
    world = World.of(places[None], PointSensor(kind="position", range_sd=0.5, glint=0), Observer(), [3])
    assert filter_of("kf", Motion()).run(world).rmse(world)[0] < 2
    with pytest.raises(InputError, match="target 'x' is known in 0 frames; allowed: in every frame"):
        target_places(source, "x")
    with pytest.raises(InputError, match=r"unknown filter 'ukff'; allowed: kf.*did you mean 'ukf'"):
        filter_of("ukff", Motion())
    with pytest.raises(InputError, match="allowed: particles from 2 on"):
        PointPF(particles=1).run(world)
    assert isinstance(FILTERS["imm"], GaussianFilter)
    assert isinstance(FILTERS["tabu_ekpf_imm"], PointPF)
    assert FILTERS["tabu_ekpf_imm"].models == TURNS

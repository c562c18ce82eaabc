"""Velocities, accelerations, Jacobians and sensitivities of random mechanisms against differences.

Differences are taken at two steps and extrapolated; how far the two are apart bounds what a difference can tell.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from helpers.random_mechanisms import Made, mechanisms
from hypothesis import assume, given, settings

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import wrap
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.geometry import offset_names
from mechdesign.mechanism.jacobians import Jacobian
from mechdesign.mechanism.outputs import acceleration_sensitivity, first, second

BEND = 0.7
STEPS = (-2, -1, 0, 1, 2)


def slopes(values: list[Floats], h: float) -> tuple[Floats, Floats]:
    """First derivative from values at -2h ... 2h, and what it may be wrong by."""
    near, far = (values[3] - values[1]) / (2 * h), (values[4] - values[0]) / (4 * h)
    return (4 * near - far) / 3, np.abs(near - far)


def bends(values: list[Floats], h: float) -> tuple[Floats, Floats]:
    """Second derivative from values at -2h ... 2h, and what it may be wrong by."""
    near = (values[3] - 2 * values[2] + values[1]) / h**2
    far = (values[4] - 2 * values[2] + values[0]) / (4 * h**2)
    return (4 * near - far) / 3, np.abs(near - far)


def agree(exact: object, difference: tuple[Floats, Floats], rounding: float, what: str) -> None:
    """An exact derivative equals a difference as far as that can tell."""
    value, error = difference
    exact = np.broadcast_to(np.asarray(exact, dtype=float), value.shape)
    # Where the two steps differ by more than this, higher derivatives are so large that a difference tells nothing.
    told = error < 1e-2 * (1 + np.abs(exact))
    miss = np.abs(exact - value) - 0.3 * error - rounding * (1 + np.abs(exact))
    assert np.all(miss[told] <= 0), (what, exact, value, error)


def along(configurations: list[Configuration], coordinate: Coordinate) -> list[Floats]:
    """A coordinate in neighbouring configurations, an angle continued from the middle one."""
    values = [np.broadcast_to(np.asarray(c.value(coordinate), dtype=float), c.shape) for c in configurations]
    if coordinate.quantity == "angle":
        return [values[2] + wrap(value - values[2]) for value in values]
    return values


@pytest.mark.nightly
@settings(max_examples=50)
@given(mechanisms())
def test_velocities_in_the_pose_drawn_are_those_of_its_own_equations(made: Made) -> None:
    mechanism, layout = made.mechanism, made.layout
    rates = [made.rates[drive] for drive in mechanism.drives]
    known = made.known()
    expected = layout.velocities([layout.drives[d] for d in mechanism.drives], rates, list(known.values()))
    configuration = mechanism.sketch_configuration
    velocity = mechanism.linearize(configuration).velocity(rates)
    for name, value in zip(known, expected, strict=True):
        got = float(first(configuration, mechanism.coordinate(name), velocity))
        assert got == pytest.approx(value, rel=1e-8, abs=1e-8), name


@pytest.mark.nightly
@settings(max_examples=50)
@given(mechanisms())
def test_velocities_and_accelerations_are_derivatives(made: Made) -> None:
    mechanism, h = made.mechanism, 1e-3
    time = np.linspace(-0.1, 0.1, 5)
    near = [made.at(time + k * h, BEND) for k in STEPS]
    ok = np.flatnonzero(np.all([c.valid for c in near], axis=0))
    assert 2 in ok
    near = [c.take(ok) for c in near]
    rates = [made.rates[drive] * (1 + BEND * time[ok]) for drive in mechanism.drives]
    linear = mechanism.linearize(near[2])
    velocity = linear.velocity(rates)
    acceleration = linear.acceleration(velocity, [made.rates[drive] * BEND for drive in mechanism.drives])
    for name in mechanism.coordinates:
        coordinate = mechanism.coordinate(name)
        values = along(near, coordinate)
        agree(first(near[2], coordinate, velocity), slopes(values, h), 1e-9, f"{name} velocity")
        agree(
            second(near[2], coordinate, velocity, velocity, acceleration),
            bends(values, h),
            1e-6,
            f"{name} acceleration",
        )


@pytest.mark.nightly
@settings(max_examples=30)
@given(mechanisms())
def test_a_jacobian_holds_the_derivatives_by_each_drive(made: Made) -> None:
    mechanism, h = made.mechanism, 1e-3
    names = made.rng.sample(mechanism.coordinates, 6)
    coordinates = [mechanism.coordinate(name) for name in names]
    configuration = mechanism.sketch_configuration
    jacobian = Jacobian.of(mechanism.linearize(configuration), coordinates).matrix
    start = made.drives(np.array(0.0))
    assert jacobian.shape == (6, len(start))
    for column in range(len(start)):
        given_values = [value + h * np.array(STEPS) * (k == column) for k, value in enumerate(start)]
        batch = mechanism.forward.solve(given_values)
        assume(batch.valid.all())
        near = [batch.take(k) for k in range(5)]
        for row, coordinate in enumerate(coordinates):
            agree(jacobian[row, column], slopes(along(near, coordinate), h), 1e-9, f"{names[row]} by drive {column}")


def _state(made: Made, time: Floats, changes: dict[str, Floats]) -> tuple[Configuration, object, object, object]:
    mechanism = made.mechanism
    configuration = mechanism.forward.solve(made.drives(time), changes)
    linear = mechanism.linearize(configuration)
    velocity = linear.velocity([made.rates[drive] for drive in mechanism.drives])
    bent = [BEND * made.rates[drive] for drive in mechanism.drives]
    return configuration, linear, velocity, linear.acceleration(velocity, bent)


@pytest.mark.nightly
@settings(max_examples=40)
@given(mechanisms())
def test_sensitivities_of_every_order_are_derivatives(made: Made) -> None:
    mechanism, h = made.mechanism, 1e-4
    time = np.array([-0.02, 0.0, 0.03])
    every = [name for name in mechanism.nominal if not name.startswith("limits")]
    places = made.rng.sample(every, min(4, len(every))) + made.rng.sample(sorted(mechanism.geometry.offsets), 2)
    configuration, linear, velocity, acceleration = _state(made, time, {})
    assume(configuration.valid.all())
    position = linear.sensitivity(places)
    velocity_z, acceleration_z = linear.rate_sensitivity(places, position, velocity, acceleration)
    orders: list[Callable[[Coordinate], object]] = [
        lambda c: first(configuration, c, position),
        lambda c: second(configuration, c, velocity, position, velocity_z),
        lambda c: acceleration_sensitivity(
            configuration, c, (velocity, acceleration), (position, velocity_z, acceleration_z)
        ),
    ]
    names = made.rng.sample([n for n in mechanism.coordinates if n not in mechanism.drives], 5)
    for row, place in enumerate(places):
        states = [_state(made, time, {place: np.array(mechanism.nominal.get(place, 0.0) + k * h)}) for k in STEPS]
        assume(all(state[0].valid.all() for state in states))
        for name in names:
            c = mechanism.coordinate(name)
            shown = [
                along([state[0] for state in states], c),
                [np.broadcast_to(first(state[0], c, state[2]), time.shape) for state in states],
                [np.broadcast_to(second(state[0], c, state[2], state[2], state[3]), time.shape) for state in states],
            ]
            for order, (values, exact) in enumerate(zip(shown, orders, strict=True)):
                derivative = np.broadcast_to(np.asarray(exact(c)), (len(places), len(time)))[row]
                agree(derivative, slopes(values, h), 1e-7, f"order {order} of {name} by {place}")


@pytest.mark.nightly
@settings(max_examples=40)
@given(mechanisms())
def test_a_pin_off_its_place_in_one_link_moves_the_others_with_it_and_leaves_guides_alone(made: Made) -> None:
    """By body coordinates, in which every link has points, lines and sliders of its own."""
    mechanism, layout = made.mechanism, made.layout
    configuration = mechanism.forward.solve(made.drives(np.array(0.0)))
    linear, held = mechanism.linearize(configuration), [layout.drives[drive] for drive in mechanism.drives]
    pins = [(link, point) for point in layout.places for link in layout.owners(point) if len(layout.owners(point)) > 1]
    for link, point in made.rng.sample(pins, min(6, len(pins))):
        for way, place in zip((1.0, 1j), offset_names(link, point), strict=True):
            expected = layout.displaced(held, link, point, way * layout.bodies[link].turn)
            nodes = linear.sensitivity([place]).nodes
            largest = max(1.0, *map(abs, expected.values()))
            for end, moved in expected.items():
                if end != f"{link}.{point}":
                    found = complex(np.ravel(nodes[mechanism.graph.node(end.partition(".")[2])])[0])
                    assert found == pytest.approx(moved, abs=1e-6 * largest**2), (place, end)


@pytest.mark.nightly
@settings(max_examples=100)
@given(mechanisms(coupled=True))
def test_sensitivities_of_coupled_mechanisms_are_derivatives(made: Made) -> None:
    """Positions of every coordinate by dimensions of links, joints and couplings."""
    mechanism, h = made.mechanism, 1e-4
    time = np.array([-0.02, 0.0, 0.03])
    every = [name for name in mechanism.nominal if not name.startswith("limits")]
    places = made.rng.sample(every, min(4, len(every)))
    configuration, linear, *_ = _state(made, time, {})
    assume(configuration.valid.all())
    position = linear.sensitivity(places)
    names = made.rng.sample([n for n in mechanism.coordinates if n not in mechanism.drives], 5)
    for row, place in enumerate(places):
        states = [_state(made, time, {place: np.array(mechanism.nominal[place] + k * h)}) for k in STEPS]
        assume(all(state[0].valid.all() for state in states))
        for name in names:
            c = mechanism.coordinate(name)
            exact = np.broadcast_to(np.asarray(first(configuration, c, position)), (len(places), len(time)))[row]
            agree(exact, slopes(along([state[0] for state in states], c), h), 1e-7, f"{name} by {place}")

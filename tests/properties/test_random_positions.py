"""Laws of position that hold for every mechanism, over random ones of any topology."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.layouts import GROUND, Coordinate
from helpers.maker import weakest
from helpers.random_mechanisms import Made, mechanisms
from helpers.studies import study_of
from hypothesis import assume, event, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mechdesign.ground.errors import MechanismError, StudyError
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import wrap
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.derivatives import regularity
from mechdesign.mechanism.jacobians import Jacobian
from mechdesign.mechanism.outputs import first, second
from mechdesign.mechanism.plan import Plan


def gaps(made: Made, configuration: Configuration) -> dict[str, NDArray]:
    """How far every link is from rigid and every joint from closed, by the drawing's own dimensions."""
    layout, found, turns = made.layout, {}, {}
    for body in layout.bodies.values():
        turn = turns[body.name] = configuration.rotation(body.name)
        found[f"{body.name} turned"] = np.abs(turn) - 1
        first = configuration.point(body.points[0])
        for point in body.points[1:]:
            local = (layout.places[point] - layout.places[body.points[0]]) / body.turn
            found[f"{point} on {body.name}"] = np.abs(configuration.point(point) - first - local * turn)
        if body.to:
            found[f"{body.name} straight"] = ((configuration.point(body.to) - first) / turn).imag
    for guide in layout.guides.values():
        line, slider = layout.bodies[guide.guide], layout.bodies[guide.slider]
        along = guide.along / line.turn * turns[line.name]
        base = guide.through or line.points[0]
        at = configuration.point(base) + (guide.base - layout.places[base]) / line.turn * turns[line.name]
        span = configuration.point(guide.point) - at
        slide = configuration.value(made.mechanism.coordinate(f"{guide.name}.slide"))
        found[f"{guide.name} on its line"] = np.abs(span - slide * along)
        if guide.kind == "prismatic":
            kept = slider.turn / guide.along
            found[f"{guide.name} not turned"] = np.abs(turns[slider.name] - kept * along)
    for name, coupling in layout.couplings.items():
        value = configuration.value(made.mechanism.coordinate(f"{coupling.coordinate[1]}.{coupling.coordinate[0]}"))
        unseen = np.zeros(1)
        for coordinate, (linear, wave) in coupling.terms.items():
            x = configuration.value(made.mechanism.coordinate(f"{coordinate[1]}.{coordinate[0]}"))
            value = value - linear * x - wave * np.sin(x)
            # Whole turns of an angle are not seen.
            whole = np.arange(-3, 4) if coordinate[0] == "angle" else np.zeros(1)
            unseen = np.add.outer(unseen, linear * 2 * math.pi * whole).ravel()
        miss = np.subtract.outer(unseen, value - coupling.constant)
        miss = np.abs(wrap(miss) if coupling.coordinate[0] == "angle" else miss)
        found[f"{name} followed"] = miss.min(axis=0)
    for clamp in layout.clamps.values():
        kept = layout.bodies[clamp.second].turn / layout.bodies[clamp.first].turn
        found[f"{clamp.name} not turned"] = np.abs(turns[clamp.second] - kept * turns[clamp.first])
    return found


def same(a: Configuration, b: Configuration) -> None:
    """Two configurations are equal bit for bit."""
    assert np.array_equal(a.reason, b.reason)
    for one, two in zip((*a.nodes, *a.rotations, *a.slides), (*b.nodes, *b.rotations, *b.slides), strict=True):
        one, two = (np.broadcast_to(np.asarray(v), a.shape) for v in (one, two))
        assert np.array_equal(one, two, equal_nan=True)


@pytest.mark.nightly
@settings(max_examples=50)
@given(mechanisms())
def test_a_sketch_is_assembled_in_the_pose_it_was_drawn_in(made: Made) -> None:
    mechanism = made.mechanism
    assert mechanism.mobility == len(made.layout.drives)
    pose = made.layout.pose(made.layout.drives)
    for configuration in (mechanism.sketch_configuration, mechanism.solve(pose).configuration):
        for point, place in made.layout.places.items():
            assert complex(configuration.point(point)) == pytest.approx(place, abs=1e-9)
        for name, coordinate in made.known().items():
            shown = float(configuration.value(mechanism.coordinate(name)))
            miss = shown - made.layout.value(coordinate)
            assert (wrap(miss) if coordinate[0] == "angle" else miss) == pytest.approx(0, abs=1e-9), name


@pytest.mark.nightly
@pytest.mark.nightly
@settings(max_examples=50)
@given(mechanisms(), st.sampled_from([0.2, 1.0, 4.0]))
def test_links_stay_rigid_and_joints_closed(made: Made, reach: float) -> None:
    time = np.linspace(-reach, reach, 41)
    configuration = made.at(time)
    ok = np.flatnonzero(configuration.valid)
    assert 20 in ok
    event(f"{10 * (len(ok) // 5)} % valid")
    closed = configuration.take(ok)
    # Slides that become nearly parallel carry their point far away: the size of each pose counts.
    far = [np.abs(np.broadcast_to(x, ok.shape)) for x in (*closed.nodes, *closed.slides)]
    bound = 1e-12 * np.maximum(1.0, np.max(far, axis=0))
    for what, gap in gaps(made, closed).items():
        assert np.all(np.abs(gap) < bound), what
    for drive, value in zip(made.mechanism.drives, made.drives(time[ok]), strict=True):
        off = closed.value(made.mechanism.coordinate(drive)) - value
        assert np.all(np.abs(wrap(off) if made.mechanism.quantity(drive) == "angle" else off) < bound), drive


@pytest.mark.nightly
@pytest.mark.nightly
@settings(max_examples=50)
@given(
    mechanisms(),
    st.floats(-3, 4),
    st.floats(-math.pi, math.pi),
    st.complex_numbers(max_magnitude=10),
    st.booleans(),
)
def test_a_drawing_moved_scaled_mirrored_renamed_and_reordered_is_the_same_mechanism(
    made: Made, power: float, turn: float, shift: complex, mirror: bool
) -> None:
    scale, names = 10**power, {}
    for old in [*made.layout.places, *made.layout.bodies, *made.layout.guides, *made.layout.clamps]:
        if old != GROUND:
            names[old] = f"n{made.rng.getrandbits(60)}"
    moved = made.layout.moved(cmath.rect(scale, turn), scale * shift, mirror=mirror)
    other = study_of(moved.text(made.rng, names)).mechanism
    time = np.linspace(-0.2, 0.2, 9)
    before = made.at(time)
    values = []
    for drive in other.drives:
        coordinate = moved.drives[drive]
        sense = (-1.0 if mirror else 1.0) if coordinate[0] == "angle" else scale
        values.append(moved.value(coordinate) + sense * made.rates[drive] * time)
    after = other.forward.solve(values)
    both = before.valid & after.valid
    assert before.valid[4]
    # What is at the very limit of motion may fall on either side of it.
    assert (before.valid != after.valid).sum() <= 1
    bound = 1e-9 * (1 + abs(shift)) * made.size
    for point in made.layout.places:
        z = before.point(point)
        expected = cmath.rect(1, turn) * (z.conj() if mirror else z) + shift
        got = after.point(names[point]) / scale
        assert np.abs(got - expected)[both].max() < bound, point


@pytest.mark.nightly
@settings(max_examples=40)
@given(mechanisms())
def test_a_rough_drawing_chooses_the_same_assembly(made: Made) -> None:
    try:
        mechanism = study_of(made.layout.text(made.rng, rough=0.01)).mechanism
    except StudyError as error:
        # The line that divides the assemblies of a long dyad may be near in degrees, though not in lengths.
        assume("1 %" not in str(error))
        raise
    pose = mechanism.solve(made.layout.pose(made.layout.drives)).configuration
    for point, place in made.layout.places.items():
        assert complex(pose.point(point)) == pytest.approx(place, abs=1e-9)


@pytest.mark.nightly
@settings(max_examples=30)
@given(mechanisms(), st.sampled_from([0.5, 3.0]))
def test_an_assembly_is_kept_along_a_sweep(made: Made, reach: float) -> None:
    """From pose to pose nothing moves farther than the speeds there allow: another assembly would be a leap."""
    mechanism = made.mechanism
    time = np.linspace(-reach, reach, 201)
    sweep = made.at(time)
    velocity = mechanism.linearize(sweep).velocity([made.rates[drive] for drive in mechanism.drives])
    both = sweep.valid[1:] & sweep.valid[:-1]
    moving = [mechanism.graph.node(name) for name in mechanism.points]
    speeds = [np.abs(np.broadcast_to(velocity.nodes[node], time.shape)) for node in moving]
    leaps = [np.abs(np.diff(np.broadcast_to(sweep.nodes[node], time.shape))) for node in moving]
    # The fastest counts: what hangs on a point that passes through infinity turns round with it.
    fastest = np.max(speeds, axis=0)
    allowed = 5 * (time[1] - time[0]) * np.maximum(fastest[1:], fastest[:-1]) + 1e-9
    # Where a closure (a squared length) may reach zero between two poses, two assemblies meet: a leg of no length.
    least = np.min([np.broadcast_to(c, time.shape) for c in sweep.closures] or [np.full(len(time), np.inf)], axis=0)
    both &= np.minimum(least[1:], least[:-1]) > allowed**2
    assert np.all(np.max(leaps, axis=0)[both] <= allowed[both])


@pytest.mark.nightly
@pytest.mark.nightly
@settings(max_examples=20)
@given(mechanisms(most=2))
def test_every_assembly_closes_and_only_the_first_is_drawn(made: Made) -> None:
    mechanism = made.mechanism
    try:
        found = assemblies(mechanism, mechanism.drives)
    except MechanismError as error:
        assume("256 " not in str(error))
        raise
    drawn = [assembly.drawn for assembly in found]
    assert drawn == [True] + [False] * (len(found) - 1)
    assert len({assembly.label for assembly in found}) == len(found)
    poses = [assembly.mechanism.plan(mechanism.drives).solve(made.drives(np.zeros(1))) for assembly in found]
    assert poses[0].valid.all()
    points = list(made.layout.places)
    for pose in poses:
        if pose.valid.all():
            for what, gap in gaps(made, pose).items():
                assert np.abs(gap).max() < 1e-9, what
    # Assemblies differ in a point, but for those of links that carry none besides their joints.
    places = [tuple(np.round(complex(pose.point(p)[0]), 6) for p in points) for pose in poses if pose.valid.all()]
    assert len(set(places)) == len(places)


@pytest.mark.nightly
@settings(max_examples=50)
@given(mechanisms(), st.sampled_from([0.3, 2.0]), st.integers(1, 12))
def test_the_order_and_the_chunks_of_a_sweep_change_no_bit(made: Made, reach: float, chunk: int) -> None:
    time = np.linspace(-reach, reach, 13)
    whole = made.at(time)
    mixed = np.array(made.rng.sample(range(13), 13))
    same(made.at(time[::-1]), whole.take(np.arange(13)[::-1]))
    same(made.at(time[mixed]), whole.take(mixed))
    for begin in range(0, 13, chunk):
        part = slice(begin, begin + chunk)
        same(made.at(time[part]), whole.take(np.arange(13)[part]))
    k = made.rng.randrange(13)
    same(made.at(time[k : k + 1]), whole.take(np.array([k])))


@pytest.mark.nightly
@settings(max_examples=50)
@given(mechanisms(), st.floats(-0.05, 0.05))
def test_other_coordinates_given_lead_back_to_the_drives(made: Made, time: float) -> None:
    """Forward to a pose; its points, angles, slides or measures, given in turn, bring the whole of it back."""
    mechanism, layout = made.mechanism, made.layout
    others: dict[Coordinate, str] = {c: name for name, c in made.known().items() if c[0] not in ("x", "y")}
    moving = [c for c in layout.coordinates() if c[0] in ("x", "y")]
    others |= {c: f"{c[1]}.{c[0]}" for c in moving}
    chosen = made.maker.regular(list(others))
    assume(chosen is not None)
    given_names = tuple(others[c] for c in chosen or ())
    try:
        plan = mechanism.plan(given_names)
    except MechanismError as error:
        assume("1 %" not in str(error))
        raise
    event("newton" if plan.iterative else "closed form")
    forward = made.at(np.linspace(0, time, 9))
    assume(forward.valid.all())
    # On the way no singularity of the inverse problem comes near, beyond which it has another working mode.
    outputs = [mechanism.coordinate(name) for name in given_names]
    felt = np.linalg.det(Jacobian.of(mechanism.linearize(forward), outputs).matrix)
    assume(np.all((felt / felt[0] > 0.3) & (felt / felt[0] < 3)))
    back = plan.solve([forward.value(mechanism.coordinate(name)) for name in given_names])
    assert back.valid.all(), given_names
    for point in layout.places:
        assert np.abs(back.point(point) - forward.point(point)).max() < 1e-8, (given_names, point)


@pytest.mark.nightly
@settings(max_examples=30)
@given(mechanisms(triads=False, anyhow=False))
def test_dyads_agree_with_newton(made: Made) -> None:
    """The same groups, once in closed form and once by Newton's method with continuation from the sketch."""
    closed = made.mechanism.forward
    groups = tuple(g if g.form == "place" else replace(g, form="newton") for g in closed.structure.groups)
    newton = Plan(made.mechanism, replace(closed.structure, groups=groups), closed.modes)
    time = np.linspace(-0.4, 0.4, 9)
    exact, found = closed.solve(made.drives(time)), newton.solve(made.drives(time))
    ok = found.valid
    assert ok[4]
    for point in made.layout.places:
        assert np.abs(found.point(point) - exact.point(point))[ok].max() < 1e-9


@settings(max_examples=15)
@given(mechanisms(coupled=True))
def test_some_couplings_hold_along_a_motion(made: Made) -> None:
    check_couplings(made)


@pytest.mark.nightly
@settings(max_examples=300)
@given(mechanisms(coupled=True))
def test_three_hundred_couplings_hold_along_a_motion(made: Made) -> None:
    check_couplings(made)


def check_couplings(made: Made) -> None:
    """The sketch is assembled as drawn; on the way from there links stay rigid, joints and couplings closed."""
    for name, coordinate in made.known().items():
        miss = float(made.mechanism.sketch_configuration.value(made.mechanism.coordinate(name)))
        miss -= made.layout.value(coordinate)
        assert (wrap(miss) if coordinate[0] == "angle" else miss) == pytest.approx(0, abs=1e-9), name
    time = np.linspace(-0.5, 0.5, 21)
    configuration = made.at(time)
    assert configuration.valid[10]
    closed = configuration.take(np.flatnonzero(configuration.valid))
    far = [np.abs(np.broadcast_to(x, closed.shape)) for x in (*closed.nodes, *closed.slides)]
    bound = 1e-12 * np.maximum(1.0, np.max(far, axis=0))
    for what, gap in gaps(made, closed).items():
        assert np.all(np.abs(gap) < bound), what


@pytest.mark.nightly
@settings(max_examples=1000)
@given(mechanisms(coupled=True))
def test_a_thousand_couplings_move_as_the_drives_that_give_the_same(made: Made) -> None:
    """The same mechanism without its coupling, one of its coordinates driven as the coupling moves it."""
    check_driven(made)


@settings(max_examples=15)
@given(mechanisms(coupled=True))
def test_some_couplings_move_as_the_drives_that_give_the_same(made: Made) -> None:
    check_driven(made)


def check_driven(made: Made) -> None:
    """Positions, velocities and accelerations with and without the coupling."""
    time = np.linspace(-0.1, 0.1, 9)
    coupled, mechanism = made.at(time), made.mechanism
    assume(coupled.valid.all())
    ((name, coupling),) = made.layout.couplings.items()
    free, drives = replace(made.layout, couplings={}), [*made.layout.drives.values()]
    candidates = (coupling.coordinate, *coupling.terms)
    by_hand = next((c for c in candidates if weakest(free.system([*drives, c])) > 0.02), None)
    assume(by_hand is not None)
    free.drives = {**made.layout.drives, name: by_hand}
    other = study_of(free.text()).mechanism
    follower = mechanism.coordinate(f"{by_hand[1]}.{by_hand[0]}")
    linear = mechanism.linearize(coupled)
    rates = linear.velocity([made.rates[drive] for drive in mechanism.drives])
    bends = linear.acceleration(rates, [0.0] * len(mechanism.drives))
    followed, rate, bend = (
        coupled.value(follower), first(coupled, follower, rates), second(coupled, follower, rates, rates, bends)
    )  # fmt: skip
    if follower.quantity == "angle":
        followed = np.unwrap(np.broadcast_to(followed, time.shape))
        # From the turn in which it is drawn.
        followed = followed + made.layout.value(by_hand) - followed[4]
    values = dict(zip(mechanism.drives, made.drives(time), strict=True)) | {name: followed}
    driven = other.forward.solve([values[drive] for drive in other.drives])
    moving = other.linearize(driven)
    # By hand it might be driven through a pose where it holds nothing, and go on in another assembly.
    regular = np.broadcast_to(regularity(moving), time.shape)
    assume(np.nanmin(regular) > 0.3 * regular[4])
    assert driven.valid.all()
    speeds = moving.velocity([rate if drive == name else made.rates[drive] for drive in other.drives])
    turning = moving.acceleration(speeds, [bend if drive == name else 0.0 for drive in other.drives])
    for point in mechanism.points:
        node, same_node = mechanism.graph.node(point), other.graph.node(point)
        assert np.abs(driven.point(point) - coupled.point(point)).max() < 1e-9, point
        for one, two in ((rates, speeds), (bends, turning)):
            near, far = (np.broadcast_to(move.nodes[at], time.shape) for move, at in ((one, node), (two, same_node)))
            assert np.abs(near - far).max() <= 1e-7 * (1 + np.abs(near).max()), point

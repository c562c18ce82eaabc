"""Efforts, joint forces and energies of random mechanisms against the laws of mechanics and bodies by Newton and Euler.

Every comparison is to 1e-10 of the largest number that takes part in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from helpers.layouts import GROUND, Coordinate, Follower, Layout
from helpers.random_dynamics import Loaded, loaded
from hypothesis import given, settings

from mechdesign.ground.numerics.arrays import Complexes, Floats

EXACT = 1e-10


def agree(one: Floats, other: Floats, what: str, size: Floats | float = 0.0) -> None:
    """Two numbers at each pose agree, relative to the larger and to a `size` of what they are made of."""
    within = EXACT * np.maximum(np.maximum(np.abs(one), np.abs(other)), size)
    assert np.all(np.abs(one - other) <= within), (what, one, other, within)


def size_of(case: Loaded) -> Floats:
    """The largest force or moment on any body or joint, at each pose."""
    bodies = case.bodies
    held = [np.abs(part).max(axis=1) for part in bodies.multipliers.values()]
    return np.max(
        [*held, np.abs(bodies.forces).max(axis=1), np.abs(bodies.inertia).max(axis=1), held[0] * 0 + 1e-3], axis=0
    )


class Wrenches:
    """The sum of forces and of their moments about the origin, on each body and pin, and how large its parts are."""

    def __init__(self, poses: int) -> None:
        self.poses = poses
        self.sums: dict[str, list[Floats | Complexes]] = {}

    def add(self, on: str, force: Complexes, place: Complexes, moment: Floats | float = 0.0) -> None:
        """A force at a place, and a moment."""
        zero = np.zeros(self.poses)
        total, turning, size = self.sums.get(on, [zero + 0j, zero, zero])
        here = (np.conj(place) * force).imag + moment
        parts = np.abs(force) * (1 + np.abs(place)) + np.abs(moment)
        self.sums[on] = [total + force, turning + here, size + parts]

    def turn(self, on: str, moment: Floats) -> None:
        """A moment."""
        self.add(on, np.zeros(self.poses, dtype=complex), np.zeros(self.poses, dtype=complex), moment)


class Row:
    """One joint force at all poses: of a pin, a clamp, a slot or a slide (of a leg too)."""

    def __init__(self, case: Loaded, k: int, count: int) -> None:
        table = case.result.tables["joint_forces"]
        self.joint, self.on, self.by = (str(table[name][k]) for name in ("joint", "on", "by"))
        self.force = table["fx"][k::count] + 1j * table["fy"][k::count]
        self.moment, self.normal = table["moment"][k::count], table["normal"][k::count]
        layout = case.layout
        self.kind, self.point = "pin", self.joint
        if self.joint in layout.guides:
            guide = layout.guides[self.joint]
            self.kind, self.point = "slot" if guide.kind == "slot" else "slide", guide.point
        elif self.joint in layout.clamps:
            self.kind, self.point = "clamp", layout.clamps[self.joint].point
        elif self.joint in layout.bodies:
            self.kind, self.point = "slide", layout.bodies[self.joint].to
        self.place = case.bodies.point(layout.owners(self.point)[0], self.point).value


def rows_of(case: Loaded) -> list[Row]:
    table = case.result.tables["joint_forces"]
    count = len(table) // case.bodies.poses
    # Moments of couplings are those of the bodies' multipliers, see `judge_equilibrium`.
    return [Row(case, k, count) for k in range(count) if table["joint"][k] not in case.layout.couplings]


def holder_of_pin(layout: Layout, point: str, rows: Sequence[Row]) -> str:
    """What bears the forces on a pin: the pin between several links, the ground, or the one link that is there."""
    if any(f"pin:{point}" in (row.on, row.by) for row in rows):
        return f"pin:{point}"
    if GROUND in layout.owners(point):
        return GROUND
    hanging = {clamp.second for clamp in layout.clamps.values() if clamp.point == point}
    (sole,) = [link for link in layout.owners(point) if link not in hanging]
    return layout.holder(sole, point)


def judge_efforts(case: Loaded) -> None:
    """Efforts by virtual work and by the drives' constraints; powers in balance; energies, and the shaking force."""
    acting, table, size = case.acting, case.result.main, size_of(case)
    assert table["valid"].all()
    bodies, layout = case.bodies, case.layout
    power = np.zeros(bodies.poses)
    for name, coordinate in layout.drives.items():
        effort, rate = table[f"{name}_effort"], bodies.coordinate(coordinate).rate
        agree(effort, bodies.virtual[name], f"{name} by virtual work", size)
        agree(effort, bodies.multipliers["drive", name][:, 0], f"{name} by its constraint", size)
        agree(table[f"{name}_power"], effort * rate, f"power of {name}", size)
        power += table[f"{name}_power"]
    agree(table["kinetic_energy"], acting.kinetic, "kinetic energy", 1e-3)
    agree(table["potential_energy"], acting.potential, "potential energy", size)
    faster = (bodies.inertia * bodies.rates).sum(axis=1)
    # Conservative forces are all but loads and dampers.
    higher = -(bodies.forces * bodies.rates).sum(axis=1) + acting.put_in - acting.lost
    speed = 1 + np.abs(bodies.rates).max(axis=1)
    agree(power, faster + higher + acting.lost - acting.put_in, "power", size * speed)
    whole = Wrenches(bodies.poses)
    for _, place, force in acting.forces:
        whole.add("all", force, place)
    for _, moment in acting.moments:
        whole.turn("all", moment)
    add_inertia(whole, case, "all")
    shaking, moment, parts = whole.sums.get("all", [np.zeros(bodies.poses)] * 3)
    agree(table["shaking.x"], np.real(shaking), "shaking.x", parts)
    agree(table["shaking.y"], np.imag(shaking), "shaking.y", parts)
    agree(table["shaking_moment"], np.real(moment), "shaking_moment", parts)


def add_inertia(wrenches: Wrenches, case: Loaded, on: str = "") -> None:
    """Weights and inertia forces of all bodies, each on itself, or all on one."""
    bodies = case.bodies
    for body, (mass, center, inertia) in case.masses.items():
        jet = bodies.place(body, case.middle(body) if center is None else center)
        pull = mass * (case.gravity - jet.acceleration(bodies.accelerations))
        wrenches.add(on or body, pull, jet.value)
        wrenches.turn(on or body, -inertia * bodies.angle(body).acceleration(bodies.accelerations))


def judge_equilibrium(case: Loaded) -> None:
    """Every body and pin is in equilibrium under its joint forces, and the ground under what shakes it."""
    acting, layout, bodies, table = case.acting, case.layout, case.bodies, case.result.main
    rows, wrenches = rows_of(case), Wrenches(case.bodies.poses)
    for row in rows:
        wrenches.add(row.on, row.force, row.place, row.moment)
        wrenches.add(row.by, -row.force, row.place, -row.moment)
    for on, place, force in acting.forces:
        wrenches.add(
            holder_of_pin(layout, on.removeprefix("pin:"), rows) if on.startswith("pin:") else on, force, place
        )
    for body, moment in acting.moments:
        wrenches.turn(body, moment)
    for name, coordinate in layout.drives.items():
        if coordinate[0] == "angle":
            wrenches.turn(coordinate[1], table[f"{name}_effort"])
            wrenches.turn(coordinate[2], -table[f"{name}_effort"])
    for name, coupling in layout.couplings.items():
        for coordinate, effort in efforts_of(case, name, coupling):
            if coordinate[0] == "angle":
                wrenches.turn(coordinate[1], effort)
                wrenches.turn(coordinate[2], -effort)
    add_inertia(wrenches, case)
    size = size_of(case)
    for on, (force, moment, parts) in wrenches.sums.items():
        shaking = (
            table["shaking.x"] + 1j * table["shaking.y"] if on == GROUND else np.zeros(bodies.poses, dtype=complex)
        )
        turning = table["shaking_moment"] if on == GROUND else np.zeros(bodies.poses)
        agree(force.real, shaking.real, f"forces along x on {on}", parts + size)
        agree(force.imag, shaking.imag, f"forces along y on {on}", parts + size)
        agree(moment.real, turning, f"moments on {on}", parts + size)


def judge_joints(case: Loaded) -> None:
    """Pins bear no moment, lines no force along them but that of a drive; all are those of the constraints."""
    size, rows, held = size_of(case), rows_of(case), case.bodies.multipliers
    for row in rows:
        if row.kind in ("slide", "slot"):
            along, across = row.force * case.bodies.line(row.joint).conj(), held["slide", row.joint][:, 0]
            agree(along.real, driven(case, row.joint), f"along {row.joint}", size)
            agree(along.imag, across, f"across {row.joint}", size)
        if row.kind == "slide":
            agree(row.normal, across, f"normal of {row.joint}", size)
        if row.kind in ("slide", "clamp"):
            agree(row.moment, held["tie", row.joint][:, 0], f"moment of {row.joint}", size)
        else:
            assert not row.moment.any(), row.joint
    for (body, point), force in at_points(case, rows).items():
        own = [row for row in rows if row.point == point and row.kind != "slide" and body in (row.on, row.by)]
        # A slot is at its pin, and nowhere in particular on its guide.
        found = sum(row.force if row.on == body else -row.force for row in own if row.kind != "slot" or row.on == body)
        agree(np.real(found), force.real, f"{point} on {body} along x", size)
        agree(np.imag(found), force.imag, f"{point} on {body} along y", size)


def driven(case: Loaded, slide: str) -> Floats:
    """The effort of the drive and of couplings along a slide, a slot or a leg; 0 where it has none."""
    drives = case.layout.drives.items()
    efforts = [
        case.bodies.multipliers["drive", k][:, 0] for k, (kind, on, *_) in drives if kind != "angle" and on == slide
    ]
    for name, coupling in case.layout.couplings.items():
        pairs = efforts_of(case, name, coupling)
        efforts += [effort for (kind, on, *_), effort in pairs if kind != "angle" and on == slide]
    return sum(efforts, np.zeros(case.bodies.poses))


def efforts_of(case: Loaded, name: str, coupling: Follower) -> list[tuple[Coordinate, Floats]]:
    """What a coupling applies to each of its coordinates: the work of all on any motion that it allows is zero."""
    effort = case.bodies.multipliers["coupling", name][:, 0]
    efforts = [(coupling.coordinate, effort)]
    for coordinate, (linear, wave) in coupling.terms.items():
        slope = linear + wave * np.cos(case.bodies.coordinate(coordinate).value)
        efforts.append((coordinate, -slope * effort))
    return efforts


def at_points(case: Loaded, rows: Sequence[Row]) -> Mapping[tuple[str, str], Complexes]:
    """By moving body and point, what the constraints of pins and slots do to the body there.

    Forces on a pin act in the bodies' model on the first link that has it. Where they do not, this link hands them on.
    """
    layout, bodies = case.layout, case.bodies
    found: dict[tuple[str, str], Complexes] = {}

    def add(link: str, point: str, force: Complexes) -> None:
        key = layout.holder(link, point), point
        if link != GROUND:
            found[key] = found.get(key, np.zeros(bodies.poses, dtype=complex)) + force

    for (kind, *names), parts in bodies.multipliers.items():
        if kind == "pin":
            point, link = names
            add(link, point, parts @ [1, 1j])
            add(layout.owners(point)[0], point, -parts @ [1, 1j])
    for guide in layout.guides.values():
        if guide.kind == "slot":
            across = bodies.multipliers["slide", guide.name][:, 0]
            add(guide.slider, guide.point, (driven(case, guide.name) + 1j * across) * bodies.line(guide.name))
    for on, _, force in case.acting.forces:
        point = on.removeprefix("pin:")
        first = layout.owners(point)[0] if point != on else ""
        if first and holder_of_pin(layout, point, rows) != layout.holder(first, point):
            add(first, point, force)
    return found


CHECKS = (judge_efforts, judge_equilibrium, judge_joints)


@settings(max_examples=8)
@given(loaded())
def test_forces_of_some_mechanisms(case: Loaded) -> None:
    for judge in CHECKS:
        judge(case)


@pytest.mark.nightly
@settings(max_examples=200)
@given(loaded())
def test_forces_of_two_hundred_mechanisms(case: Loaded) -> None:
    for judge in CHECKS:
        judge(case)


@settings(max_examples=5)
@given(loaded(coupled=True))
def test_forces_of_some_coupled_mechanisms(case: Loaded) -> None:
    for judge in CHECKS:
        judge(case)


@pytest.mark.nightly
@settings(max_examples=200)
@given(loaded(coupled=True))
def test_forces_of_two_hundred_coupled_mechanisms(case: Loaded) -> None:
    for judge in CHECKS:
        judge(case)

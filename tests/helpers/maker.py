"""Lays groups of links, in an assembled pose, on links that are there already: driven links, dyads, larger groups."""

from __future__ import annotations

import cmath
import copy
import math
from collections.abc import Sequence
from random import Random

import numpy as np

from helpers.layouts import GROUND, Body, Clamp, Coordinate, Follower, Guide, Layout
from mechdesign.ground.numerics.arrays import Floats

# A group: its new links ("link" or telescopic "leg"), its joints (kind, link, link), the base being -1, and its
# drives (kind, new link). R revolute, P prismatic, S pin in slot, F fixed; which side has the line is drawn.
Joint = tuple[str, int, int]
Recipe = tuple[tuple[str, ...], tuple[Joint, ...], tuple[tuple[str, int], ...]]


def _chain(kinds: str, *drives: tuple[str, int]) -> Recipe:
    """Links from base to base, joined by joints of these kinds."""
    count = len(kinds) - 1
    ends = [*range(count), -1]
    return ("link",) * count, tuple((kind, k - 1, ends[k]) for k, kind in enumerate(kinds)), drives


def _star(inner: str, outer: str, legs: bool = False) -> Recipe:
    """A link that three others join to bases."""
    joints = [(kind, 0, k) for k, kind in enumerate(inner, 1)] + [(kind, k, -1) for k, kind in enumerate(outer, 1)]
    if legs:
        return ("link", "leg", "leg", "leg"), tuple(joints), (("length", 1), ("length", 2), ("length", 3))
    return ("link",) * 4, tuple(joints), ()


DRIVEN: dict[str, Recipe] = {
    "crank": (("link",), (("R", -1, 0),), (("angle", 0),)),
    "carriage": (("link",), (("P", -1, 0),), (("slide", 0),)),
    "boom": (("leg",), (("R", -1, 0),), (("angle", 0), ("length", 0))),
    "jack": (("leg", "link"), (("R", -1, 0), ("R", 0, 1), ("R", 1, -1)), (("length", 0),)),
    "sleeve": (("leg", "link"), (("R", -1, 0), ("P", 0, 1), ("R", 1, -1)), (("length", 0),)),
    "lift": (("leg", "link"), (("R", -1, 0), ("R", 0, 1), ("P", 1, -1)), (("length", 0),)),
    "ram": _chain("RPRR", ("slide", 0)),
    "stroke": _chain("RPRP", ("slide", 0)),
    "press": _chain("PPRR", ("slide", 1)),
    "elbow": _chain("RRRP", ("angle", 1)),
    "trammel": (("link",), (("S", -1, 0), ("S", 0, -1)), (("angle", 0),)),
    "slotted": (("link",), (("S", -1, 0), ("S", 0, -1)), (("slide", 0),)),
}
DYADS: dict[str, Recipe] = {kinds: _chain(kinds) for kinds in ("RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR")} | {
    "RS": (("link",), (("R", -1, 0), ("S", 0, -1)), ()),
    "SR": (("link",), (("S", -1, 0), ("R", 0, -1)), ()),
    "PS": (("link",), (("P", -1, 0), ("S", 0, -1)), ()),
    "leg": (("leg",), (("R", -1, 0), ("R", 0, -1)), ()),
    "clamp": (("link",), (("F", -1, 0),), ()),
}
TRIADS: dict[str, Recipe] = {
    "RRR-RRR": _star("RRR", "RRR"),
    "RRR-RPR": _star("RRR", "RPR"),
    "RPR-RRR": _star("RPR", "RRR"),
    "RRP-PRR": _star("RRP", "PRR"),
    "platform": _star("RRR", "RRR", legs=True),
    "SSS": (("link",), (("S", -1, 0), ("S", 0, -1), ("S", -1, 0)), ()),
    "RRS": (("link", "link"), (("R", -1, 0), ("R", 0, 1), ("S", 1, -1), ("S", 1, -1)), ()),
}
# Least singular value (as `weakest` has it) of a group's equations, its base held, and of the whole's with its
# drives. Lengths are near one, so this is a distance from the nearest singularity.
GROUP, WHOLE = 0.12, 0.04
TRIALS = 40


class Maker:
    """Lays group upon group; each is drawn anew until it is far from its singularities."""

    def __init__(self, seed: int) -> None:
        self.rng = Random(seed)
        self.count = 0
        self.layout = Layout(unit=self.rng.choice(["deg", "deg", "rad"]))
        points = [self.name("G") for _ in range(self.rng.randint(1, 4))]
        self.layout.bodies[GROUND] = Body(GROUND, 0j, 1 + 0j, points)
        self.layout.places = {point: self.spot(0j) for point in points}
        if self.rng.random() < 0.3:
            self.layout.bodies[GROUND].style = "measured"

    def name(self, prefix: str) -> str:
        self.count += 1
        return f"{prefix}{self.count}"

    def spot(self, near: complex, far: float = 2.5) -> complex:
        return near + cmath.rect(self.rng.uniform(0.6, far), self.rng.uniform(-math.pi, math.pi))

    def add(self, recipe: Recipe) -> bool:
        """Lay a group on the layout; False where no trial was far from its singularities."""
        before, drives = self.layout, recipe[2]
        for _ in range(TRIALS):
            self.layout = copy.deepcopy(before)
            new = self._lay(recipe)
            if new is None:
                continue
            rigid = [body for body in self.layout.rigid() if body.removesuffix(":rod") in new]
            given = [self._drive(kind, new[index]) for kind, index in drives]
            matrix = np.vstack([self.layout.equations(rigid), *(self.layout.rate(c, rigid)[None] for c in given)])
            if matrix.shape[0] == matrix.shape[1] and weakest(matrix) > GROUP:
                self.layout.drives.update({self.name("d"): c for c in given})
                whole = self.layout.system(list(self.layout.drives.values()))
                if weakest(whole) > WHOLE and max(map(abs, self.layout.places.values())) < 8:
                    return True
        self.layout = before
        return False

    def _drive(self, kind: str, body: str) -> Coordinate:
        if kind == "angle":
            others = [name for name in self.layout.bodies if name != body]
            return ("angle", body, self.rng.choice([GROUND, *others]))
        if kind == "slide":
            slides = [g.name for g in self.layout.guides.values() if body in (g.guide, g.slider)]
            return ("slide", self.rng.choice(slides))
        return ("length", body)

    def _lay(self, recipe: Recipe) -> list[str] | None:
        """Joints first, then the frames of the new links."""
        kinds, joints, _ = recipe
        rng, layout = self.rng, self.layout
        old = list(layout.bodies)
        centre = self.spot(layout.places[rng.choice(list(layout.places))], 1.5)
        new = [self.name("L") for _ in kinds]
        for body, kind in zip(new, kinds, strict=True):
            layout.bodies[body] = Body(body, complex("nan"), 1 + 0j, [], "leg" if kind == "leg" else "")
        pinned: dict[str, list[str]] = {body: [] for body in new}
        for kind, a, b in sorted(joints, key=lambda joint: "PSRF".index(joint[0])):
            base = rng.choice(old)
            one, two = (base if k < 0 else new[k] for k in (a, b))
            if kind in "PS":
                self._line(kind, one, two, old, centre)
            elif kind == "F":
                self._clamp(one, two)
            else:
                self._pin([body for body in (one, two) if body in new], base if -1 in (a, b) else "", centre, pinned)
        for body in new:
            if not self._frame(layout.bodies[body], centre):
                return None
        return new

    def _put(self, body: str, prefix: str, at: complex) -> str:
        point = self.name(prefix)
        self.layout.places[point] = at
        self.layout.bodies[body].points.append(point)
        return point

    def _line(self, kind: str, one: str, two: str, old: Sequence[str], centre: complex) -> None:
        """A prismatic joint or slot between two links, either of them the one with the line."""
        rng, layout = self.rng, self.layout
        guide, slider = rng.sample([one, two], 2)
        along = cmath.rect(1, rng.uniform(-math.pi, math.pi))
        shift = rng.choice([-1, 1]) * rng.uniform(0.4, 1.6)
        line, other = layout.bodies[guide], layout.bodies[slider]
        through = ""
        if slider in old and rng.random() < 0.5 and not set(other.points) <= set(line.points):
            # A point that is there already slides; on a line of a new link, which may be laid so.
            point = rng.choice([p for p in [*other.points, *[other.to] * bool(other.to)] if p not in line.points])
            if guide in old:
                return
            base = layout.places[point] - shift * along
            through = self._put(guide, "T", base)
        else:
            if guide in old:
                choice = rng.random()
                known = [*line.points, *[line.to] * bool(line.to)]
                if choice < 0.2:
                    base = line.origin
                elif choice < 0.6 and known:
                    through = rng.choice(known)
                    base = layout.places[through]
                else:
                    base = self.spot(line.origin, 1.5)
                    through = self._put(guide, "T", base)
            else:
                base = self.spot(centre, 1.2)
                if cmath.isnan(line.origin) and rng.random() < 0.25 and line.style != "leg":
                    line.origin = base
                else:
                    through = self._put(guide, "T", base)
            point = self._put(slider, "Q", base + shift * along)
        name = self.name("J")
        joint = Guide(name, "slot" if kind == "S" else "prismatic", guide, slider, through, base, along, point)
        if through and through != line.to and rng.random() < 0.3:
            joint.toward = self._put(guide, "T", base + rng.uniform(0.5, 1.5) * along)
        layout.guides[name] = joint

    def _pin(self, new: list[str], base: str, centre: complex, pinned: dict[str, list[str]]) -> None:
        """A revolute joint of one or two new links, at a point of the base or of a slide where one is drawn."""
        rng, layout = self.rng, self.layout
        bodies = [layout.bodies[body] for body in new]
        if base:
            known = [*layout.bodies[base].points, *[layout.bodies[base].to] * bool(layout.bodies[base].to)]
            if known and rng.random() < 0.5:
                point = rng.choice(known)
                if point in bodies[0].points:
                    return
                bodies[0].points.append(point)
                pinned[new[0]].append(point)
                return
            bodies.append(layout.bodies[base])
        drawn = [p for body in bodies[: len(new)] if body.style != "leg" for p in body.points if p[0] in "TQ"]
        free = [p for p in drawn if layout.owners(p) in ([new[0]], [new[-1]])]
        if free and rng.random() < 0.5:
            point = rng.choice(free)
        else:
            point = self.name("R")
            layout.places[point] = self.spot(centre, 1.8)
        for body in bodies:
            if point not in body.points:
                body.points.append(point)
        for body in new:
            pinned[body].append(point)

    def _clamp(self, base: str, new: str) -> None:
        body, rng = self.layout.bodies[base], self.rng
        known = [*body.points, *[body.to] * bool(body.to)]
        point = rng.choice(known) if known else self._put(base, "R", self.spot(body.origin))
        self.layout.bodies[new].points.append(point)
        self._put(new, "E", self.spot(self.layout.places[point]))
        drawn = base == GROUND or body.to or len(body.points) > 1
        name = self.name("J")
        self.layout.clamps[name] = Clamp(name, base, new, point, told=not drawn or rng.random() < 0.5)

    def _frame(self, body: Body, centre: complex) -> bool:
        """Points on no joint, and a frame; False where the points it would be laid by are too near one another."""
        rng, places = self.rng, self.layout.places
        if body.style == "leg":
            ends = [p for p in body.points if p[0] in "RGE" or len(self.layout.owners(p)) > 1][:2]
            while len(ends) < 2:
                ends.append(self._put(body.name, "E", self.spot(places[ends[0]] if ends else centre)))
            # What the lines of the leg go through stays with the body at its beginning.
            body.points = [ends[0], *(p for p in body.points if p not in ends)]
            body.to = ends[1]
            span = places[body.to] - places[ends[0]]
            body.origin, body.turn = places[ends[0]], span / (abs(span) or 1.0)
            return abs(span) > 0.4
        extra = rng.choice([0, 0, 1, 2]) if body.points else 1
        for _ in range(extra):
            self._put(body.name, "E", self.spot(centre))
        rng.shuffle(body.points)
        fixed = not cmath.isnan(body.origin)
        body.style = rng.choice(["frame", "binary", "pair", "measured", "measured pair"])
        if fixed or len(body.points) < 2 or body.style == "frame":
            body.style = "frame"
            lines = [g.along for g in self.layout.guides.values() if body.name in (g.guide, g.slider)]
            any_turn = cmath.rect(1, rng.uniform(-math.pi, math.pi))
            body.turn = rng.choice(lines) if lines and rng.random() < 0.4 else any_turn
            if not fixed:
                body.origin = places[rng.choice(body.points)] if rng.random() < 0.6 else self.spot(centre)
            return True
        first, second = (places[p] for p in body.points[:2])
        body.origin = first
        body.turn = (second - first) / (abs(second - first) or 1.0)
        return abs(second - first) > 0.4

    def finish(self, *, anyhow: bool) -> Layout:
        """Points that show how every link lies, measures, and, if `anyhow`, drives drawn from all coordinates."""
        rng, layout = self.rng, self.layout
        for together in layout.classes():
            bodies = [layout.bodies[name] for name in together]
            if not any(b.name == GROUND or b.to or len(b.points) > 1 for b in bodies):
                body = rng.choice(bodies)
                self._put(body.name, "E", self.spot(body.origin))
        for body in layout.bodies.values():
            spare = [p for p in body.points if p[0] == "E" and layout.owners(p) == [body.name]]
            if body.style not in ("measured", "measured pair") and len(body.points) > 2 + len(spare):
                layout.undrawn.update(p for p in spare if rng.random() < 0.5)
        if anyhow:
            others = self.regular(layout.drivable())
            if others:
                layout.drives = {self.name("d"): c for c in others}
        names = list(layout.bodies)
        points = [p for p in layout.places if GROUND not in layout.owners(p)]
        for _ in range(2):
            if len(names) > 2:
                layout.measures[self.name("m")] = ("angle", *rng.sample(names, 2))
            one, two = (rng.choice(list(layout.places)), rng.choice(points))
            if abs(layout.places[one] - layout.places[two]) > 0.3:
                layout.measures[self.name("m")] = ("distance", one, two)
        layout.measures[self.name("m")] = ("product", rng.choice(points), rng.choice(points))
        return layout

    def couple(self) -> bool:
        """Take one drive away and let a coordinate follow others; False where that is near a singularity."""
        rng, layout, before = self.rng, self.layout, dict(self.layout.drives)
        if len(before) < 2:
            return False
        listed = [c for c in layout.drivable() if c[0] != "angle" or c[2] == GROUND]
        for _ in range(TRIALS):
            taken = rng.choice(list(before))
            layout.drives = {name: c for name, c in before.items() if name != taken}
            follower, *others = rng.sample(listed, min(len(listed), rng.choice([2, 2, 3])))
            if before[taken] in listed and rng.random() < 0.6:
                follower = before[taken]
            terms = {
                c: (rng.choice([-1, 1]) * rng.uniform(0.3, 2), rng.choice([0.0, 0.0, rng.uniform(-0.3, 0.3)]))
                for c in others
                if c != follower
            }
            if not terms or follower in layout.drives.values():
                continue
            value = sum(a * layout.value(c) + b * math.sin(layout.value(c)) for c, (a, b) in terms.items())
            layout.couplings = {self.name("c"): Follower(follower, terms, layout.value(follower) - value)}
            system = layout.system(list(layout.drives.values()))
            if system.shape[0] == system.shape[1] and weakest(system) > WHOLE:
                return True
        layout.drives, layout.couplings = before, {}
        return False

    def regular(self, candidates: Sequence[Coordinate]) -> list[Coordinate] | None:
        """As many coordinates as there are drives, far from a singularity when they are given; None if not found."""
        columns, count = self.layout.rigid(), len(self.layout.drives)
        # The free motions of the mechanism, and what each coordinate feels of them.
        free = np.linalg.svd(self.layout.equations(columns))[2][-count:].T
        felt = {c: self.layout.rate(c, columns) @ free for c in candidates}
        for _ in range(TRIALS):
            chosen = self.rng.sample(list(candidates), count)
            if weakest(np.array([felt[c] for c in chosen])) > WHOLE and weakest(self.layout.system(chosen)) > WHOLE:
                return chosen
        return None


def weakest(matrix: Floats) -> float:
    """At most the smallest singular value of a square matrix, and no less than that over the root of its size."""
    try:
        return float(1 / np.linalg.norm(np.linalg.inv(matrix)))
    except np.linalg.LinAlgError:
        return 0.0

"""Bodies of the elastic mechanism, and the edges through which they bear on one another."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from mechdesign.mechanism.cams import Engagement
from mechdesign.mechanism.coordinates import Coordinate, Coupled, leaves
from mechdesign.mechanism.elements.drives import Drive
from mechdesign.mechanism.elements.springs import Spring
from mechdesign.mechanism.graph import GROUND, origin_of, rod_of
from mechdesign.mechanism.joint_contacts import PIN
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.questions.stiffness.elements import (
    Beam,
    Element,
    Hinge,
    JointCompliance,
    Shift,
    SlideElement,
    SpringElement,
)
from mechdesign.questions.stiffness.schema import StiffnessSection

# The body whose stiffness is computed, where it is not a link: a pin, or the end of an elastic link.
TARGET = ":asked"


@dataclass(frozen=True)
class NetworkEdge:
    """A joint, or a stretch of beams, from vertex `a` to vertex `b`, with its freedoms in order from `a`.

    Parameters
    ----------
    name : str
        Of a joint, its point or slide; of beams, their link.
    point : str
        The joint's point; of beams, the point at their end.
    """

    a: str
    b: str
    elements: tuple[Element, ...]
    name: str
    point: str

    @property
    def beam(self) -> Beam | None:
        """The stretch of a link's beams; None for a joint."""
        return next((element for element in self.elements if isinstance(element, Beam)), None)


@dataclass(frozen=True, eq=False)
class BodyCoupling:
    """A coupling between bodies.

    Parameters
    ----------
    engagement : Engagement or None
        The wheels that press or pull each other, or the cam and its follower; None of other couplings.
    seats : mapping of str to tuple of str
        Vertices of the link that follows and of the one that moves it, by the coupling's name; or by each coordinate of
        the gap those of both links of an angle, of a slider and its guide, or of points.
    """

    coupling: Coupled
    engagement: Engagement | None
    seats: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class Bodies:
    """Bodies of a mechanism and the edges and couplings that connect them.

    Parameters
    ----------
    target : str
        The body whose stiffness is computed: that of the `link`, or `TARGET` for a pin or the end of an elastic link.
    link : str or None
        None for a pin.
    points : mapping of str to tuple of (str, str)
        Points of each moving link, with the vertices to which they belong.
    pins : mapping of str to str
        By point, the vertex on which a force at its pin acts.
    """

    edges: tuple[NetworkEdge, ...]
    target: str
    link: str | None
    points: Mapping[str, tuple[tuple[str, str], ...]]
    pins: Mapping[str, str]
    transmissions: tuple[BodyCoupling, ...]

    @cached_property
    def carrying(self) -> list[NetworkEdge]:
        """Edges that can carry a load of the asked body: vertices with a single edge and no coupling are removed, again
        and again.
        """
        edges = list(self.edges)
        coupled = {vertex for t in self.transmissions for seats in t.seats.values() for vertex in seats}
        while True:
            degree = Counter(end for edge in edges for end in (edge.a, edge.b))
            stays = {GROUND, self.target, *coupled}
            loose = {vertex for vertex, count in degree.items() if count == 1 and vertex not in stays}
            if not loose:
                return edges
            edges = [edge for edge in edges if edge.a not in loose and edge.b not in loose]


def link_of(body: str) -> str:
    """The link to which a body belongs; empty for a massless body."""
    return "" if body.startswith((PIN, "slot:", TARGET)) else body.removesuffix(":rod")


def is_pin(body: str) -> bool:
    """Whether a body is the massless pin of several links."""
    return body.startswith(PIN)


def build_bodies(
    mechanism: Mechanism, link: str | None, at: str, section: StiffnessSection, loaded: Collection[str] = ()
) -> Bodies:
    """Bodies with all joints of a mechanism, the motors without a joint, and the beams of elastic links.

    If the asked link is elastic, the asked body is its cross-section at the point `at`. At `loaded` points forces act
    on the pin itself.
    """
    graph, description = mechanism.graph, mechanism.description

    holder = graph.holder
    target = TARGET if link is None or link in section.elastic else holder(link, at)
    loaded = {*loaded, *(graph.nodes[node] for c in mechanism.couplings for link, node in c.gap.ends if not link)}
    builder = _Builder(mechanism, section, target, loaded)
    holders = {point: [*bodies] for point, bodies in graph.holders.items() if ":" not in point}
    for slide, (name, (guide, slider)) in enumerate(zip(graph.slides, graph.guides, strict=True)):
        point = graph.sliding(slide)
        if not slider:
            slider = f"slot:{name}"
            holders[point].append(slider)
        base = description.links[name].corners[0] if slide in graph.telescopic else None
        builder.slide(slide, guide, slider, point, base)
    clamps = [*graph.clamps.values()]
    if target == TARGET:
        holders[at].append(TARGET)
        if link is not None:
            clamps.append((holder(link, at), TARGET, at))
    for a, b, point in clamps:
        builder.join(a, b, (), point, point)
    pins = {point: _clusters(point, bodies, clamps) for point, bodies in holders.items()}
    for point, clusters in pins.items():
        builder.hinges(point, clusters)
    for drive in description.drives.values():
        if drive.kind == "angle" and drive.name not in builder.held:
            builder.motor(drive, pins)
    for spring in description.springs.values():
        builder.spring(spring, holders)
    for name in section.elastic:
        builder.beams(name)
    transmissions = builder.transmissions()
    return Bodies(tuple(builder.edges), target, link, builder.points(), builder.pins, transmissions)


@dataclass
class _Builder:
    """Collects edges.

    `riding` are the slides on each body, with the points that ride there; `held` are the drives that hold a joint;
    `pins` are the vertices on which forces at points act.
    """

    mechanism: Mechanism
    section: StiffnessSection
    target: str
    loaded: Collection[str]
    edges: list[NetworkEdge] = field(default_factory=list)
    riding: dict[str, dict[str, str]] = field(default_factory=dict)
    held: set[str | None] = field(default_factory=set)
    pins: dict[str, str] = field(default_factory=dict)

    def join(
        self, a: str, b: str, elements: tuple[Element, ...], name: str, point: str, seat: str | None = None
    ) -> None:  # fmt: skip
        """Add a joint between two bodies at a point, on body `a` at the point or slide `seat`."""
        self.edges.append(NetworkEdge(self._vertex(a, seat or point), self._vertex(b, point), elements, name, point))

    def slide(self, slide: int, a: str, b: str, point: str, base: str | None) -> None:
        """Add a slide of body `b` along body `a`; the bearing of a telescopic leg is at its `base`."""
        name = self.mechanism.graph.slides[slide]
        drives = self.mechanism.description.drives.values()
        drive = next((d.name for d in drives if d.kind != "angle" and d.target == name), None)
        elements = (*self._freedom(SlideElement(slide, drive)), *self._bearing(name, base or point, slide))
        # The beam of a leg's rod begins at the base.
        end = self._vertex(b, point) if base is None else self._node(b, base)
        self.edges.append(NetworkEdge(self._vertex(a, name), end, elements, name, point))
        self.riding.setdefault(a, {})[name] = point

    def hinges(self, point: str, clusters: list[list[str]]) -> None:
        """Add the pin of clusters of bodies, with its bearing: between two, or between each of more and the pin."""
        if len(clusters) < 2:
            for cluster in clusters:
                self.pins[point] = self._vertex(self._hinged_body(cluster), point)
            return
        fixed = next((cluster for cluster in clusters if GROUND in cluster), None)
        hub = fixed or next((cluster for cluster in clusters if self.target in cluster), None)
        # The ground and the asked body hold each cluster directly; an asked pin lies midway between two links.
        if hub is None or not (fixed or hub == [TARGET] or len(clusters) == 2 or point not in self.section.bearings):
            hub = clusters[0] if len(clusters) == 2 and point not in self.loaded else [PIN + point]
        give = 0.5 if len(clusters) == 2 and is_pin(hub[0]) else 1.0
        if hub == [TARGET]:
            give = {2: 0.0, 3: 0.5}.get(len(clusters), 1.0)
        self.pins[point] = self._vertex(self._hinged_body(hub), point)
        for cluster in clusters:
            if cluster is not hub:
                drive = self._drive_between(hub, cluster)
                elements = (*self._freedom(Hinge(point, drive)), *self._bearing(point, point, None, give))
                self.join(self._hinged_body(hub), self._hinged_body(cluster), elements, point, point)

    def motor(self, drive: Drive, pins: Mapping[str, list[list[str]]]) -> None:
        """Add a motor between two links without a common joint: at a pin of both, or else at their first points."""
        links = (drive.reference, drive.target)
        seat, point = (next(iter(self.mechanism.description.links[link].points), origin_of(link)) for link in links)
        a, b = links
        for pin, clusters in pins.items():
            body, other_body = (next((b for c in clusters for b in c if link_of(b) == link), None) for link in links)
            if body is not None and other_body is not None:
                a, b, seat, point = body, other_body, pin, pin
                break
        elements = (Shift(1.0 + 0j), Shift(1j), *self._freedom(Hinge(point, drive.name)))
        self.join(a, b, elements, drive.name, point, seat)

    def spring(self, spring: Spring, holders: Mapping[str, list[str]]) -> None:
        """Add a spring between two links, or between bodies at its points, about which it turns freely."""
        geometry = self.mechanism.geometry
        coil = SpringElement(spring, geometry)
        if not spring.pull(lambda term: geometry.term(term, {}))[1]:
            return
        one, other = spring.between
        if spring.turning:
            seat, point = (next(iter(self.mechanism.description.links[link].points)) for link in spring.between)
            self.join(one, other, (Shift(1.0 + 0j), Shift(1j), coil), spring.name, point, seat)
            return
        bodies, points = [], [end.rpartition(".")[2] for end in spring.between]
        for end, point in zip(spring.between, points, strict=True):
            link = end.rpartition(".")[0]
            bodies.append(next((body for body in holders[point] if link_of(body) == link), holders[point][0]))
        hinges = (Hinge(points[1]),) if coil.isotropic else (Hinge(points[0]), Hinge(points[1]))
        self.join(bodies[0], bodies[1], (*hinges, coil), spring.name, points[1], points[0])

    def beams(self, name: str) -> None:
        """Add the beams of a link, from their beginning to each other point and to each slide on the link."""
        link = self.mechanism.description.links[name]
        body = rod_of(name) if link.telescopic else name
        points = {point: point for point in link.corners}
        if not link.telescopic:
            points |= {point: point for point in link.points} | self.riding.get(name, {})
        root, *seats = points
        section = self.section.elastic[name]
        for seat in seats:
            beam = Beam(link, root, points[seat], section)
            self.edges.append(NetworkEdge(f"{body}@{root}", f"{body}@{seat}", (beam,), name, points[seat]))

    def transmissions(self) -> tuple[BodyCoupling, ...]:
        """The couplings, each with the vertices on which it acts."""
        mechanism, graph = self.mechanism, self.mechanism.graph
        pairs: list[Engagement] = [*mechanism.meshes, *mechanism.cams]
        engagements = {pair.coupling: pair for pair in pairs}
        transmissions = []
        for coupling in mechanism.couplings:
            pair = engagements.get(coupling.name)
            if pair is not None:
                ends = zip(pair.links, pair.nodes, strict=True)
                seats = {coupling.name: tuple(self._on_link(link, graph.nodes[node]) for link, node in ends)}
            else:
                seats = {part.name: self._seats(part) for part in leaves(coupling.gap)}
            transmissions.append(BodyCoupling(coupling, pair, seats))
        return tuple(transmissions)

    def _seats(self, part: Coordinate) -> tuple[str, ...]:
        """Vertices on which an effort on a coordinate acts.

        That on an angle acts at the pin that both links share, or else on each at its first point.
        """
        graph = self.mechanism.graph
        if part.kind == "slide":
            return next((edge.b, edge.a) for edge in self.edges if edge.name == graph.slides[part.slide])
        if part.kind == "angle":
            bodies = part.body, part.reference
            one, other = ([p for body, p in graph.points if body == b and ":" not in p] for b in bodies)
            shared = [point for point in one if point in other]
            seats = (next(iter(shared or points), "") for points in (one, other))
            return tuple(self._node(body, seat) for body, seat in zip(bodies, seats, strict=True))
        ends = [(link, graph.nodes[node]) for link, node in part.ends]
        return tuple(self._on_link(link, point) if link else self.pins[point] for link, point in ends)

    def _on_link(self, link: str, point: str) -> str:
        """The vertex of a link at a point; at its first point where that is the origin of its frame."""
        if ":" in point:
            return self._node(link, next(iter(self.mechanism.description.links[link].points), ""))
        return self._node(self.mechanism.graph.holder(link, point), point)

    def points(self) -> dict[str, tuple[tuple[str, str], ...]]:
        """Points of each moving link, with their vertices."""
        points = {}
        for name, link in self.mechanism.description.links.items():
            if name == GROUND:
                continue
            vertices = [(point, self._node(name, point)) for point in link.points]
            if link.tip is not None:
                vertices.append((link.tip, self._node(rod_of(name), link.tip)))
            points[name] = tuple(vertices)
        return points

    def _freedom(self, element: Hinge | SlideElement) -> tuple[Element, ...]:
        """The freedom of a joint; none if a rigid drive holds it."""
        self.held.add(element.drive)
        return (element,) if element.drive is None or element.drive in self.section.actuators else ()

    def _bearing(self, name: str, point: str, slide: int | None, give: float = 1.0) -> tuple[Element, ...]:
        return (JointCompliance(name, point, slide, give),) if name in self.section.bearings else ()

    def _node(self, body: str, point: str) -> str:
        """The vertex of a body at one of its points."""
        link = link_of(body)
        if body == GROUND or link not in self.section.elastic:
            return body
        telescopic = self.mechanism.description.links[link].telescopic
        # The first body of a telescopic leg is rigid; the second is the cantilever from the leg's base to its end.
        return body if telescopic and body == link else f"{body}@{point}"

    def _vertex(self, body: str, point: str) -> str:
        """The vertex of a body at a joint; that of a telescopic leg's rod is at its end."""
        link = self.mechanism.description.links.get(link_of(body))
        return self._node(body, point if link is None or link.tip is None else link.tip)

    def _drive_between(self, first: list[str], second: list[str]) -> str | None:
        """The drive of the angle between two clusters of bodies; None if there is none."""
        clusters = [set(map(link_of, cluster)) for cluster in (first, second)]
        for drive in self.mechanism.description.drives.values():
            across = any(drive.target in a and drive.reference in b for a, b in (clusters, clusters[::-1]))
            if drive.kind == "angle" and across:
                return drive.name
        return None

    def _hinged_body(self, cluster: list[str]) -> str:
        """The body of a cluster to which others are hinged: the ground or the asked body, or else the first."""
        return next((body for body in (GROUND, self.target) if body in cluster), cluster[0])


def _clusters(point: str, bodies: list[str], clamps: list[tuple[str, str, str]]) -> list[list[str]]:
    """Bodies at a point, those that are clamped to each other there in one cluster."""
    clusters = [[body] for body in bodies]
    for a, b, place in clamps:
        if place == point:
            joined = [c for c in clusters if a in c or b in c]
            clusters = [c for c in clusters if c not in joined] + [[body for c in joined for body in c]]
    return clusters

"""The mechanism as a model for MuJoCo: bodies in a tree, loops closed by equality constraints, drives as actuators."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from mechdesign import __version__
from mechdesign.exporting.bodies import Bodies, Body, Joint, Sum
from mechdesign.exporting.drawing import hull
from mechdesign.exporting.exports import Content, export
from mechdesign.exporting.view import View
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.core import Bound
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Spring
from mechdesign.report.figures.shapes import link_colors

# Step of integration (s), and time constant with which constraints are held, in seconds.
STEP, HELD = 5e-4, 1e-3
# Impedance of the constraints: the part of a deviation's acceleration that they take away.
IMPEDANCE = 0.9999
# Natural frequency of a position servo on all masses of the mechanism (1/s).
SERVO = 20.0
# Decimals of places (m).
DECIMALS = 12
# A side of a range that is left open (rad, m).
OPEN = 1e6


@export("model.xml", "the mechanism for MuJoCo (MJCF): bodies, joints, masses, springs, drives", order=50)
def model_xml(view: View) -> Content:
    """The mechanism as MJCF, and what MuJoCo does not get."""
    bodies = Bodies(view)
    text = Model(bodies).text()
    return Content(text, (*view.assumed, *bodies.left_out))


def numbers(*values: float) -> str:
    """Numbers for an attribute, with ten digits."""
    return " ".join(f"{value + 0.0:.10g}" for value in values)


def planar(place: complex) -> str:
    """A place or vector of the plane in space."""
    return numbers(round(place.real, DECIMALS), round(place.imag, DECIMALS), 0.0)


def comment(words: Iterable[str]) -> Element:
    """Lines as a comment, in which no two hyphens follow each other."""
    return Comment("".join(f"\n  {line.replace('--', '- -')}" for line in words) + "\n")


def outlines(bodies: Bodies, body: Body) -> tuple[list[tuple[complex, complex]], float]:
    """Straight parts of a body's plate in its frame, and half of its width (m); blocks and rods are smaller."""
    view, length = bodies.view, bodies.scales.length
    radius = length * float(view.sizes.radius(body.link))
    link = bodies.description.links[body.link]
    if ":block" in body.name:
        return [(0j, 0j)], 0.7 * radius
    if link.telescopic:
        reach = 0.6 * length * abs(float(view.pose.slides[bodies.graph.slides.index(body.link)]))
        return ([(-reach + 0j, 0j)], 0.6 * radius) if ":rod" in body.name else ([(0j, reach + 0j)], radius)
    corners = hull([length * place for place in view.outline(body.link)])
    if len(corners) < 3:
        return [(corners[0], corners[-1])], radius
    return list(zip(corners, [*corners[1:], corners[0]], strict=True)), radius


class Model:
    """The model of a mechanism's bodies."""

    def __init__(self, bodies: Bodies) -> None:
        self.bodies, self.view = bodies, bodies.view
        self.root = Element("mujoco", model=self.view.study.name)
        self.colors = link_colors(bodies.mechanism)
        self.bounded: dict[str, tuple[float, float]] = {}

    @property
    def free(self) -> bool:
        """Whether the study gives efforts of the drives, so that motors move them; servos hold them elsewhere."""
        section = self.view.study.dynamics
        return section is not None and section.forward is not None

    def text(self) -> str:
        """The file."""
        bodies, root = self.bodies, self.root
        SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
        SubElement(
            root, "option", timestep=numbers(STEP), gravity=planar(bodies.gravity),
            integrator="RK4" if self.free else "implicitfast", tolerance="1e-12", iterations="200",
        )  # fmt: skip
        defaults = SubElement(root, "default")
        SubElement(
            defaults, "equality", solref=numbers(HELD, 1), solimp=numbers(IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2)
        )
        SubElement(defaults, "geom", contype="0", conaffinity="0", mass="0")
        SubElement(defaults, "site", size=numbers(0.01 * bodies.size))
        world = SubElement(root, "worldbody")
        SubElement(world, "light", pos=numbers(0, 0, 3 * bodies.size), dir="0 0 -1", directional="true")
        self.named: set[str] = set()
        self.tendons, self.equality = Element("tendon"), Element("equality")
        self.actuators, self.sensors = Element("actuator"), Element("sensor")
        self._bodies(world)
        self._closures()
        self._couplings()
        self._limits(world)
        self._springs()
        self._drives()
        for point in bodies.mechanism.points:
            SubElement(self.sensors, "framepos", name=point, objtype="site", objname=point)
        root.extend(part for part in (self.tendons, self.equality, self.actuators, self.sensors) if len(part))
        root.insert(0, comment(self._words()))
        if bodies.description.friction:
            bodies.leave_out("friction", "MuJoCo's friction in joints does not grow with their forces")
        if self.view.study.dynamics is not None and self.view.study.dynamics.loads:
            bodies.leave_out("dynamics.loads", "loads follow time and motion; apply them from your program")
        indent(root)
        return tostring(root, encoding="unicode") + "\n"

    def _words(self) -> list[str]:
        bodies = self.bodies
        light = [body.name for body in bodies.bodies.values() if not body.weighed and body.name != GROUND]
        lines = [
            f"{self.view.study.name}: written by mechdesign {__version__}",
            f"At {self.view.posed}. Metres, kilograms, seconds, radians; the mechanism moves in the x-y plane.",
            "A pin's coordinate is the angle of its body against the one that carries it.",
        ]
        if light:
            lines.append(f"Without a mass in the study, and so with {bodies.small_mass:.3g} kg: {', '.join(light)}.")
        return lines

    def _bodies(self, world: Element) -> None:
        elements = {GROUND: world}
        self._shown(world, GROUND)
        for joint in self.bodies.joints.values():
            body, parent = self.bodies.bodies[joint.child], self.bodies.bodies[joint.parent]
            angle = cmath.phase(body.turn * parent.turn.conjugate())
            element = SubElement(
                elements[joint.parent], "body", name=body.name, pos=planar(parent.local(body.origin)),
                euler=numbers(0, 0, angle),
            )  # fmt: skip
            elements[body.name] = element
            if joint.kind != "fixed":
                self._joint(element, joint, body)
            SubElement(
                element, "inertial", pos=planar(body.center), mass=numbers(body.mass),
                diaginertia=numbers(body.inertia, body.inertia, body.inertia),
            )  # fmt: skip
            self._shown(element, body.name)

    def _joint(self, element: Element, joint: Joint, body: Body) -> None:
        slides = joint.kind == "slide"
        axis = joint.along * body.turn.conjugate()
        SubElement(
            element, "joint", name=joint.name, type="slide" if slides else "hinge",
            axis=planar(axis) if slides else "0 0 1", pos=planar(body.local(joint.place)), ref=numbers(joint.value),
        )  # fmt: skip

    def _shown(self, element: Element, name: str) -> None:
        """Geoms of a body's plate, and sites at those of its points that no other body has shown."""
        body = self.bodies.bodies[name]
        parts, radius = outlines(self.bodies, body)
        color = self.colors[body.link].lstrip("#")
        paint = [int(color[k : k + 2], 16) / 255 for k in (0, 2, 4)]
        for begin, end in parts:
            shape = {"type": "capsule", "fromto": f"{planar(begin)} {planar(end)}"}
            if abs(end - begin) <= 1e-9 * self.bodies.size:
                shape = {"type": "sphere", "pos": planar(begin)}
            SubElement(
                element, "geom", **shape, size=numbers(radius),
                rgba=" ".join(f"{value:.3g}" for value in (*paint, 1.0)),
            )  # fmt: skip
        for point, place in body.points.items():
            if point not in self.named:
                self.named.add(point)
                SubElement(element, "site", name=point, pos=planar(place))

    def _closures(self) -> None:
        for joint in self.bodies.closures:
            first, second = (joint.child, joint.parent) if joint.parent == GROUND else (joint.parent, joint.child)
            other = {} if second == GROUND else {"body2": second}
            anchor = planar(self.bodies.bodies[first].local(joint.place))
            kind = "connect" if joint.kind == "hinge" else "weld"
            SubElement(self.equality, kind, name=joint.name, body1=first, **other, anchor=anchor)

    def _couplings(self) -> None:
        bodies = self.bodies
        for coupling in bodies.mechanism.couplings:
            terms = bodies.sum_of(coupling.gap)
            if terms is None:
                bodies.leave_out(
                    f"coupling {coupling.name}",
                    "MuJoCo has no function of this kind, and what it sets moves freely there",
                )
            elif len(terms) == 2:
                (follower, own), (leader, other) = terms.items()
                ratio = numbers(0, -other / own, 0, 0, 0)
                SubElement(
                    self.equality, "joint", name=coupling.name, joint1=follower, joint2=leader, polycoef=ratio
                )
            else:
                self._fixed(coupling.name, terms)
                SubElement(self.equality, "tendon", name=coupling.name, tendon1=coupling.name)

    def _fixed(self, name: str, terms: Sum, **more: str) -> None:
        """A tendon whose length is a sum of coordinates."""
        tendon = SubElement(self.tendons, "fixed", name=name, **more)
        for joint, rate in terms.items():
            SubElement(tendon, "joint", joint=joint, coef=numbers(rate))

    def _spatial(self, name: str, ends: Sequence[str], **more: str) -> None:
        """A tendon straight from point to point."""
        tendon = SubElement(self.tendons, "spatial", name=name, width=numbers(0.005 * self.bodies.size), **more)
        for end in ends:
            SubElement(tendon, "site", site=end.rpartition(".")[2])

    def _range(self, bound: Bound, terms: Sum) -> tuple[float, float]:
        """Range of a bound coordinate's sum of joint coordinates."""
        bodies, coordinate = self.bodies, bound.coordinate
        scale = bodies.scales.length if coordinate.quantity == "length" else 1.0
        low, high = (
            side * OPEN if end is None else scale * float(end)
            for side, end in zip((-1, 1), bound.ends(bodies.mechanism.nominal), strict=True)
        )
        value = scale * float(bodies.view.pose.value(coordinate))
        if bound.of_angle:
            turn = TURN * round((value - (low + high) / 2) / TURN)
            low, high = low + turn, high + turn
        away = bodies.value(terms) - value
        return low + away, high + away

    def _limits(self, world: Element) -> None:
        bodies = self.bodies
        for bound in bodies.mechanism.bounds:
            coordinate = bound.coordinate
            if coordinate.kind == "distance":
                nodes = (bodies.graph.nodes[node] for node in (coordinate.node, coordinate.other))
                scale = bodies.scales.length
                low, high = (None if end is None else scale * float(end) for end in bound.ends(bodies.mechanism.nominal))
                self._spatial(f"limit.{bound.label}", [*nodes], range=numbers(low or 0.0, OPEN if high is None else high))
                continue
            terms = bodies.sum_of(coordinate)
            if terms is None:
                bodies.leave_out(f"limit of {coordinate.name}", "it is no sum of coordinates of joints")
                continue
            ends = self._range(bound, terms)
            if bound.drive:
                self.bounded[coordinate.name] = ends
            if [*terms.values()] == [1.0]:
                joint = next(joint for joint in world.iter("joint") if joint.get("name") in terms)
                joint.set("range", numbers(*ends))
            else:
                self._fixed(f"limit.{bound.label}", terms, range=numbers(*ends))

    def _springs(self) -> None:
        for name, spring in self.bodies.description.springs.items():
            if spring.turning:
                one, other = (self.bodies.angle(link) for link in spring.between)
                terms = other | {joint: other.get(joint, 0.0) - rate for joint, rate in one.items()}
                terms = {joint: rate for joint, rate in terms.items() if rate}
                if terms:
                    self._spring(name, spring, terms)
            else:
                self._spring(name, spring, None)

    def _spring(self, name: str, spring: Spring, terms: Sum | None) -> None:
        """A spring and damper on a tendon; a pull that does not vanish without stiffness is an actuator's."""
        bodies, scales, geometry = self.bodies, self.bodies.scales, self.bodies.mechanism.geometry
        stiffness, free, preload, push, damping = (
            float(geometry.term(term, {}))
            for term in (spring.stiffness, spring.free, spring.preload, spring.push, spring.damping)
        )
        pull = (preload - push) * scales.force
        stiffness, damping = stiffness * scales.force, damping * scales.force * scales.time
        if terms is None:
            stiffness, damping, rest = stiffness / scales.length, damping / scales.length, free * scales.length
        else:
            stiffness, damping, pull = (scales.length * value for value in (stiffness, damping, pull))
            one, other = (complex(bodies.view.pose.body_rotation(link)) for link in spring.between)
            stretch = math.remainder(cmath.phase(other * one.conjugate()) - free, TURN)
            rest = bodies.value(terms) - stretch
        if stiffness:
            rest, pull = rest - pull / stiffness, 0.0
        # A length of -1 stands for that in the pose.
        springs = {"stiffness": numbers(stiffness), "springlength": numbers(rest, rest)} if stiffness else {}
        more = {**springs, "damping": numbers(damping)}
        if terms is None:
            self._spatial(name, spring.between, **more)
        else:
            self._fixed(name, terms, **more)
        if pull:
            SubElement(
                self.actuators, "general", name=name, tendon=name, gainprm="0", biastype="affine",
                biasprm=numbers(-pull, 0, 0),
            )  # fmt: skip

    def _drives(self) -> None:
        """A motor of each drive where the study gives efforts, else a servo that holds a position."""
        bodies, values = self.bodies, list[float]()
        mass = sum(body.mass for name, body in bodies.bodies.items() if name != GROUND)
        for name in bodies.mechanism.drives:
            drive = bodies.mechanism.coordinate(name)
            terms = bodies.sum_of(drive)
            assert terms is not None
            at = {"joint": next(iter(terms))}
            if [*terms.values()] != [1.0]:
                self._fixed(name, terms)
                at = {"tendon": name}
            if self.free:
                SubElement(self.actuators, "motor", name=name, **at)
                values.append(0.0)
            else:
                inertia = mass * (bodies.size**2 if drive.quantity == "angle" else 1.0)
                gain = inertia * SERVO**2
                ends = self.bounded.get(name)
                more = {} if ends is None else {"ctrlrange": numbers(*ends)}
                SubElement(
                    self.actuators, "position", name=name, **at, kp=numbers(gain),
                    kv=numbers(2 * math.sqrt(gain * inertia)), **more,
                )  # fmt: skip
                values.append(bodies.value(terms))
            kind = "jointpos" if "joint" in at else "tendonpos"
            SubElement(self.sensors, kind, name=f"drive.{name}", **at)
        others = len(self.actuators) - len(values)
        keys = SubElement(self.root, "keyframe")
        SubElement(keys, "key", name="pose", ctrl=numbers(*([0.0] * others), *values))

"""The mechanism as a model for MuJoCo: bodies in a tree, loops closed by equality constraints, drives as actuators."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from xml.etree.ElementTree import Element, indent, tostring

from mechdesign.door.exporting.bodies import OPEN, BodyJoint, RigidBodies, RigidBody, Sum
from mechdesign.door.exporting.exports import Content, export
from mechdesign.door.exporting.model_text import add, comment, name_of, numbers, outlines, paint, planar, words
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.ground.errors import printable
from mechdesign.mechanism.graph import GROUND

# Step of integration (s), and time constant with which constraints are held, in seconds.
STEP, HELD = 5e-4, 1e-3
# Impedance of the constraints: the part of a deviation's acceleration that they take away.
IMPEDANCE = 0.9999


@export(
    "model.xml", "the mechanism for MuJoCo (MJCF): bodies, joints, masses, springs, drives", order=50, options=("at",)
)
def model_xml(view: PosedStudy) -> Content:
    """The mechanism as MJCF, and what MuJoCo does not get."""
    bodies = RigidBodies(view)
    text = MjcfModel(bodies).text()
    return Content(text, (*view.assumed, *bodies.left_out))


class MjcfModel:
    """The model of a mechanism's bodies."""

    def __init__(self, bodies: RigidBodies) -> None:
        self.bodies, self.view = bodies, bodies.view
        self.root = Element("mujoco", model=printable(self.view.study.name))
        self.colors = paint(bodies.mechanism)
        self.bounded: dict[str, tuple[float, float]] = {}

    def text(self) -> str:
        """The file."""
        bodies, root = self.bodies, self.root
        add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
        add(
            root, "option", timestep=numbers(STEP), gravity=planar(bodies.gravity),
            integrator="RK4" if self.bodies.free else "implicitfast", tolerance="1e-12", iterations="200",
        )  # fmt: skip
        defaults = add(root, "default")
        add(defaults, "equality", solref=numbers(HELD, 1), solimp=numbers(IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2))
        add(defaults, "geom", contype="0", conaffinity="0", mass="0")
        add(defaults, "site", size=numbers(0.01 * bodies.size))
        world = add(root, "worldbody")
        add(world, "light", pos=numbers(0, 0, 3 * bodies.size), dir="0 0 -1", directional="true")
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
            add(self.sensors, "framepos", name=point, objtype="site", objname=point)
        root.extend(part for part in (self.tendons, self.equality, self.actuators, self.sensors) if len(part))
        about = "A pin's coordinate is the angle of its body against the one that carries it."
        root.insert(0, comment([*words(bodies), about]))
        indent(root)
        return tostring(root, encoding="unicode") + "\n"

    def _bodies(self, world: Element) -> None:
        elements = {GROUND: world}
        self._shown(world, GROUND)
        for joint in self.bodies.joints.values():
            body, parent = self.bodies.bodies[joint.child], self.bodies.bodies[joint.parent]
            angle = cmath.phase(body.turn * parent.turn.conjugate())
            element = add(
                elements[joint.parent], "body", name=name_of(body.name), pos=planar(parent.local(body.origin)),
                euler=numbers(0, 0, angle),
            )  # fmt: skip
            elements[body.name] = element
            if joint.kind != "fixed":
                self._joint(element, joint, body)
            add(
                element, "inertial", pos=planar(body.center), mass=numbers(body.mass),
                diaginertia=numbers(body.inertia, body.inertia, body.inertia),
            )  # fmt: skip
            self._shown(element, body.name)

    def _joint(self, element: Element, joint: BodyJoint, body: RigidBody) -> None:
        slides = joint.kind == "slide"
        axis = joint.along * body.turn.conjugate()
        add(
            element, "joint", name=joint.name, type="slide" if slides else "hinge",
            axis=planar(axis) if slides else "0 0 1", pos=planar(body.local(joint.place)), ref=numbers(joint.value),
        )  # fmt: skip

    def _shown(self, element: Element, name: str) -> None:
        """Geoms of a body's plate, and sites at those of its points that no other body has shown."""
        body = self.bodies.bodies[name]
        parts, radius = outlines(self.bodies, body)
        for begin, end in parts:
            shape = {"type": "capsule", "fromto": f"{planar(begin)} {planar(end)}"}
            if abs(end - begin) <= 1e-9 * self.bodies.size:
                shape = {"type": "sphere", "pos": planar(begin)}
            add(element, "geom", **shape, size=numbers(radius), rgba=self.colors[body.link])
        for point, place in body.points.items():
            if point not in self.named:
                self.named.add(point)
                add(element, "site", name=point, pos=planar(place))

    def _closures(self) -> None:
        for joint in self.bodies.closures:
            first, second = (joint.child, joint.parent) if joint.parent == GROUND else (joint.parent, joint.child)
            other = {} if second == GROUND else {"body2": name_of(second)}
            anchor = planar(self.bodies.bodies[first].local(joint.place))
            kind = "connect" if joint.kind == "hinge" else "weld"
            add(self.equality, kind, name=joint.name, body1=name_of(first), **other, anchor=anchor)

    def _couplings(self) -> None:
        bodies = self.bodies
        for coupling in bodies.mechanism.couplings:
            name, terms = f"coupling.{coupling.name}", bodies.sum_of(coupling.gap)
            if terms is None:
                bodies.leave_out(
                    f"coupling {coupling.name}", "MuJoCo has no function of its kind, and what it sets moves freely"
                )
            elif len(terms) == 2:
                (follower, own), (leader, other) = terms.items()
                ratio = numbers(0, -other / own, 0, 0, 0)
                add(self.equality, "joint", name=name, joint1=follower, joint2=leader, polycoef=ratio)
            else:
                self._fixed(name, terms)
                add(self.equality, "tendon", name=name, tendon1=name)

    def _fixed(self, name: str, terms: Sum, **more: str) -> None:
        """A tendon whose length is a sum of coordinates."""
        tendon = add(self.tendons, "fixed", name=name, **more)
        for joint, rate in terms.items():
            add(tendon, "joint", joint=joint, coef=numbers(rate))

    def _spatial(self, name: str, ends: Sequence[str], **more: str) -> None:
        """A tendon straight from point to point."""
        tendon = add(self.tendons, "spatial", name=name, width=numbers(0.005 * self.bodies.size), **more)
        for end in ends:
            add(tendon, "site", site=end.rpartition(".")[2])

    def _limits(self, world: Element) -> None:
        bodies = self.bodies
        for number, bound in enumerate(bodies.mechanism.bounds, start=1):
            name, coordinate = f"limit.{number}", bound.coordinate
            if coordinate.kind == "distance":
                nodes = (bodies.graph.nodes[node] for node in (coordinate.node, coordinate.other))
                scale = bodies.scales.length
                low, high = (
                    None if end is None else scale * float(end) for end in bound.ends(bodies.mechanism.nominal)
                )
                self._spatial(name, [*nodes], range=numbers(low or 0.0, OPEN if high is None else high))
                continue
            terms = bodies.sum_of(coordinate)
            if terms is None:
                bodies.leave_out(f"limit of {coordinate.name}", "it is no sum of coordinates of joints")
                continue
            ends = bodies.range_of(bound, terms)
            if bound.drive:
                self.bounded[coordinate.name] = ends
            if [*terms.values()] == [1.0]:
                joint = next(joint for joint in world.iter("joint") if joint.get("name") in terms)
                joint.set("range", numbers(*ends))
            else:
                self._fixed(name, terms, range=numbers(*ends))

    def _springs(self) -> None:
        """Springs and dampers as tendons; a pull that does not vanish without stiffness is an actuator's."""
        for own, spring in self.bodies.description.springs.items():
            name, pull = f"spring.{own}", self.bodies.pull_of(spring)
            rest = {"stiffness": numbers(pull.stiffness), "springlength": numbers(pull.rest, pull.rest)}
            more = {**(rest if pull.stiffness else {}), "damping": numbers(pull.damping)}
            if pull.terms is None:
                self._spatial(name, spring.between, **more)
            elif pull.terms:
                self._fixed(name, pull.terms, **more)
            if pull.constant:
                add(
                    self.actuators, "general", name=name, tendon=name, gainprm="0", biastype="affine",
                    biasprm=numbers(-pull.constant, 0, 0),
                )  # fmt: skip

    def _drives(self) -> None:
        """A motor of each drive where the study gives efforts, else a servo that holds a position."""
        bodies, values = self.bodies, list[float]()
        for name in bodies.mechanism.drives:
            drive = bodies.mechanism.coordinate(name)
            terms = bodies.sum_of(drive)
            assert terms is not None
            at = {"joint": next(iter(terms))}
            if [*terms.values()] != [1.0]:
                self._fixed(name, terms)
                at = {"tendon": name}
            if self.bodies.free:
                add(self.actuators, "motor", name=name, **at)
                values.append(0.0)
            else:
                gain, damping = bodies.servo(drive)
                ends = self.bounded.get(name)
                more = {} if ends is None else {"ctrlrange": numbers(*ends)}
                add(
                    self.actuators, "position", name=name, **at, kp=numbers(gain),
                    kv=numbers(damping), **more,
                )  # fmt: skip
                values.append(bodies.value(terms))
            kind = "jointpos" if "joint" in at else "tendonpos"
            add(self.sensors, kind, name=f"drive.{name}", **at)
        others = len(self.actuators) - len(values)
        keys = add(self.root, "keyframe")
        add(keys, "key", name="pose", ctrl=numbers(*([0.0] * others), *values))

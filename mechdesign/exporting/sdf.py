"""The mechanism as a model for Gazebo (SDF 1.11): links in the plane, joints of the tree and joints that close loops.

Joints count from the pose that is shown: their coordinates are 0 there.
"""

from __future__ import annotations

import cmath
import math
from xml.etree.ElementTree import Element, indent, tostring

from mechdesign.errors import printable
from mechdesign.exporting.bodies import OPEN, Bodies, Joint, Sum
from mechdesign.exporting.exports import Content, export
from mechdesign.exporting.model_text import WORLD, add, comment, name_of, numbers, outlines, paint, planar, words
from mechdesign.exporting.view import View
from mechdesign.mechanism.graph import GROUND

VERSION = "1.11"
_CONTROLLER = ("gz-sim-joint-position-controller-system", "gz::sim::systems::JointPositionController")
_FORCE = ("gz-sim-apply-joint-force-system", "gz::sim::systems::ApplyJointForce")
_TYPES = {"hinge": "revolute", "slide": "prismatic", "fixed": "fixed"}


@export("model.sdf", "the mechanism for Gazebo (SDF): links, joints, masses, drives", order=51, options=("at",))
def model_sdf(view: View) -> Content:
    """The mechanism as SDF, and what Gazebo does not get."""
    bodies = Bodies(view)
    text = Model(bodies).text()
    return Content(text, (*view.assumed, *bodies.left_out))


def put(element: Element, tag: str, text: str) -> None:
    """Add an element with a text."""
    add(element, tag).text = text


class Model:
    """The model of a mechanism's bodies."""

    def __init__(self, bodies: Bodies) -> None:
        self.bodies = bodies
        self.root = Element("sdf", version=VERSION)
        self.model = add(self.root, "model", name=printable(bodies.view.study.name))
        self.axes: dict[str, Element] = {}

    def text(self) -> str:
        """The file."""
        bodies, model, gravity = self.bodies, self.model, self.bodies.gravity
        if gravity:
            # The plane stands upright, so that the world's gravity has the direction that the study gives.
            lean = math.pi / 2 + cmath.phase(gravity)
            put(model, "pose", numbers(0, 0, 0, math.pi / 2, lean, 0))
        put(model, "self_collide", "false")
        self._links()
        ground = add(model, "joint", name="fixed.ground", type="fixed")
        put(ground, "parent", WORLD)
        put(ground, "child", GROUND)
        for joint in (*bodies.joints.values(), *bodies.closures):
            self._joint(joint)
        self._couplings()
        self._limits()
        self._springs()
        drives = self._drives()
        lines = [*words(bodies), f"Coordinates of joints are 0 in this pose, where {', '.join(drives)}."]
        if gravity:
            lines.append(f"The world's gravity has to be 0 0 {numbers(-abs(gravity))}; the model stands upright in it.")
        self.root.insert(0, comment(lines))
        indent(self.root)
        return tostring(self.root, encoding="unicode", xml_declaration=False) + "\n"

    def _links(self) -> None:
        colors = paint(self.bodies.mechanism)
        for body in self.bodies.bodies.values():
            link = add(self.model, "link", name=name_of(body.name))
            put(link, "pose", f"{planar(body.origin)} 0 0 {numbers(cmath.phase(body.turn))}")
            inertial = add(link, "inertial")
            put(inertial, "pose", f"{planar(body.center)} 0 0 0")
            put(inertial, "mass", numbers(body.mass))
            inertia = add(inertial, "inertia")
            for axes in ("xx", "yy", "zz"):
                put(inertia, f"i{axes}", numbers(body.inertia))
            for axes in ("xy", "xz", "yz"):
                put(inertia, f"i{axes}", "0")
            parts, radius = outlines(self.bodies, body)
            for k, (begin, end) in enumerate(parts):
                visual = add(link, "visual", name=f"plate{k + 1}")
                along = end - begin
                put(visual, "pose", f"{planar((begin + end) / 2)} {numbers(0, math.pi / 2, cmath.phase(along))}")
                shape = add(add(visual, "geometry"), "capsule" if along else "sphere")
                put(shape, "radius", numbers(radius))
                if along:
                    put(shape, "length", numbers(abs(along)))
                material = add(visual, "material")
                put(material, "ambient", colors[body.link])
                put(material, "diffuse", colors[body.link])

    def _joint(self, joint: Joint) -> None:
        parent, child = joint.parent, joint.child
        if child == GROUND:
            parent, child = child, parent
        body = self.bodies.bodies[child]
        element = add(self.model, "joint", name=joint.name, type=_TYPES[joint.kind])
        put(element, "pose", f"{planar(body.local(joint.place))} 0 0 0")
        put(element, "parent", name_of(parent))
        put(element, "child", name_of(child))
        if joint.kind != "fixed":
            axis = add(element, "axis")
            put(axis, "xyz", planar(joint.along * body.turn.conjugate()) if joint.kind == "slide" else "0 0 1")
            limit = add(axis, "limit")
            put(limit, "lower", "-inf")
            put(limit, "upper", "inf")
            self.axes[joint.name] = axis

    def _couplings(self) -> None:
        for coupling in self.bodies.mechanism.couplings:
            terms = self.bodies.sum_of(coupling.gap)
            if terms is None or len(terms) != 2:
                self.bodies.leave_out(
                    f"coupling {coupling.name}",
                    "SDF couples two joints by a ratio alone, and what it sets moves freely",
                )
                continue
            (follower, own), (leader, other) = terms.items()
            mimic = add(self.axes[follower], "mimic", joint=leader)
            put(mimic, "multiplier", numbers(-other / own))
            put(mimic, "offset", "0")
            put(mimic, "reference", "0")

    def _alone(self, terms: Sum | None) -> str | None:
        """The one joint whose coordinate a sum is."""
        return next(iter(terms)) if terms is not None and [*terms.values()] == [1.0] else None

    def _limits(self) -> None:
        for bound in self.bodies.mechanism.bounds:
            terms = self.bodies.sum_of(bound.coordinate)
            name = self._alone(terms)
            if terms is None or name is None:
                self.bodies.leave_out(f"limit of {bound.coordinate.name}", "SDF limits single joints alone")
                continue
            limit = self.axes[name].find("limit")
            assert limit is not None
            ends = self.bodies.range_of(bound, terms)
            for end, tag in zip(ends, ("lower", "upper"), strict=True):
                side = limit.find(tag)
                assert side is not None
                side.text = numbers(end - self.bodies.joints[name].value) if abs(end) < OPEN / 2 else side.text

    def _springs(self) -> None:
        for name, spring in self.bodies.description.springs.items():
            pull = self.bodies.pull_of(spring)
            joint = self._alone(pull.terms)
            if joint is None or pull.constant:
                self.bodies.leave_out(f"spring {name}", "SDF has springs that turn single joints alone")
                continue
            dynamics = Element("dynamics")
            put(dynamics, "damping", numbers(pull.damping))
            put(dynamics, "spring_reference", numbers(pull.rest - self.bodies.joints[joint].value))
            put(dynamics, "spring_stiffness", numbers(pull.stiffness))
            self.axes[joint].insert(1, dynamics)

    def _drives(self) -> list[str]:
        """A controller of each drive that is a joint; returns what each drive's value is in the pose."""
        values, bodies = [], self.bodies
        for name in bodies.mechanism.drives:
            drive = bodies.mechanism.coordinate(name)
            terms = bodies.sum_of(drive)
            joint = self._alone(terms)
            assert terms is not None
            unit = "rad" if drive.quantity == "angle" else "m"
            values.append(f"drive {name} ({joint or 'no single joint'}) is {numbers(bodies.value(terms))} {unit}")
            if joint is None:
                bodies.leave_out(f"drive {name}", "it moves no single joint of the tree")
                continue
            file, system = _FORCE if bodies.free else _CONTROLLER
            plugin = add(self.model, "plugin", filename=file, name=system)
            put(plugin, "joint_name", joint)
            if not bodies.free:
                for gain, tag in zip(bodies.servo(drive), ("p_gain", "d_gain"), strict=True):
                    put(plugin, tag, numbers(gain))
        return values

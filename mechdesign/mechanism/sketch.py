"""The sketch: rough places of points, from which assembly modes, drive values and starting guesses are read."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.errors import MechanismError
from mechdesign.mechanism.algebra import Value, Vector, cross, fit
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.loops import Loops, walk
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.structure import Group, Structure, whole

# A joint this near to its dividing line, as a fraction of the distances around it, chooses no side.
UNDECIDED = 0.01
SKETCH = "mechanism.sketch"
# Forms of groups without an assembly mode: with a single assembly, or with one that is searched for.
WITHOUT_MODE = ("place", "coupled", "linear", "newton", "two slides")


@dataclass
class Sketch(Loops):
    """Position of each node and rotation of each angle class as drawn; `None` where the sketch does not show them."""

    def modes(self, structure: Structure) -> tuple[int, ...]:
        """Assembly mode (+1 or -1) of each group of a structure as drawn; 0 for groups that have none.

        Raises
        ------
        MechanismError
            Where points that decide are not in the sketch, or one lies within 1 % of its dividing line.
        """
        missing = {
            node
            for group in structure.groups
            if group.form not in WITHOUT_MODE
            for k, _ in group.loops[0].edges
            if structure.ties[structure.edges[k].frame].root in group.angles
            for node in (structure.edges[k].tail, structure.edges[k].head)
            if self.nodes[node] is None
        }
        if missing:
            names, one = ", ".join(f"'{self.graph.nodes[node]}'" for node in sorted(missing)), len(missing) == 1
            subject, them = (f"point {names} is", "it") if one else (f"points {names} are", "them")
            raise MechanismError(f"{subject} needed to choose the assembly; add {them} to the sketch", SKETCH)
        return tuple(self._mode(structure, group) for group in structure.groups)

    def _mode(self, structure: Structure, group: Group) -> int:
        if group.form in WITHOUT_MODE:
            return 0
        (loop,) = group.loops
        # The direction is missing only of a link that is drawn as a point; then it decides nothing, and any will do.
        turns = [1.0 if turn is None else turn for turn in self.rotations]
        nodes = [np.nan if node is None else node for node in self.nodes]
        drawn = replace(self, structure=structure, nodes=nodes, rotations=turns)
        a, b = drawn.columns(group, loop.edges, drawn.chord)[1]
        away, size = side(group, a, b)
        if group.form == "two angles":
            ends = [self.graph.nodes[node] for node in (loop.start, loop.end)]
            line = f"the line {'-'.join(ends)}" if ends[0] != ends[1] and ":" not in "".join(ends) else "the line"
        else:
            line = f"the perpendicular to slide '{self.graph.slides[group.slides[0]]}'"
        if np.abs(away) <= UNDECIDED * size:
            names = " or ".join(f"'{name}'" for name in deciding_joints(self.graph, group))
            raise MechanismError(
                f"{names} lies within 1 % of {line} that divides the two assemblies; draw it clearly on one side",
                SKETCH,
            )
        return 1 if away > 0 else -1

    def value(self, coordinate: Coordinate) -> float | None:
        """Value of a drive as drawn (radians or length), or `None` where the sketch does not show it."""
        if coordinate.kind == "angle":
            turns = []
            for body in (coordinate.body, coordinate.reference):
                turn = self.rotations[self.graph.bodies[body][0]]
                if turn is None:
                    return None
                turns.append(turn * self.vectors.offsets[body])
            return float(np.angle(turns[0] * np.conj(turns[1])))
        k, edge = next((k, e) for k, e in enumerate(self.graph.edges) if e.slide == coordinate.slide)
        parts = (self.nodes[edge.tail], self.nodes[edge.head], self.rotations[edge.frame])
        return None if any(value is None for value in parts) else float(self.displacement(k))

    def unknowns(self, structure: Structure) -> list[float]:
        """Angles and slides of the groups without a closed form as drawn: where Newton's method starts."""
        starts: list[float] = []
        for group in (structure.groups[index] for index in structure.unknowns):
            for root in group.angles:
                turn = self.rotations[root] if root < self.graph.classes else None
                if turn is None and not group.loops:
                    turn = 1.0
                if turn is None:
                    link = next((body for body, (frame, _) in self.graph.bodies.items() if frame == root), "?")
                    message = f"the points of link '{link}' are needed as a start; add them to the sketch"
                    raise MechanismError(message, SKETCH)
                starts.append(float(np.angle(turn)))
            for slide in group.slides:
                value = self.value(Coordinate("", "slide", "length", slide=slide))
                if value is None:
                    raise MechanismError(
                        f"the ends of '{self.graph.slides[slide]}' are needed as a start; add them to the sketch",
                        SKETCH,
                    )
                starts.append(value)
        return starts


def locate(description: Description, graph: Graph, geometry: Geometry) -> Sketch:
    """Place whole links from the points drawn, and further points from the links so placed."""
    sketch = Sketch.start(graph, whole(graph), geometry.nominal, ())
    nodes, rotations = sketch.nodes, sketch.rotations
    for k, name in enumerate(graph.nodes):
        if name in description.sketch:
            nodes[k] = description.sketch[name]
    for k, edge in enumerate(graph.edges):
        if edge.frame == 0 and edge.slide is None and edge.tail == 0:
            nodes[edge.head] = sketch.edge(k)
    changed = True
    while changed:
        changed = False
        for frame in range(1, graph.classes):
            if rotations[frame] is None:
                fit = _fit(sketch, geometry, frame)
                if abs(fit) > 0:
                    rotations[frame] = fit / abs(fit)
                    changed = True
        for k, edge in enumerate(graph.edges):
            placed = [nodes[end] is not None for end in (edge.tail, edge.head)]
            if edge.slide is None and rotations[edge.frame] is not None and any(placed) and not all(placed):
                walk(graph.edges, [(k, 1 if placed[0] else -1)], nodes, sketch.edge)
                changed = True
        changed = changed or _lay_along_slide(sketch)
    return sketch


def _lay_along_slide(sketch: Sketch) -> bool:
    """Take the direction of a class from one of its slides, as if displaced forwards; False where there is none."""
    for k, edge in enumerate(sketch.graph.edges):
        tail, head = sketch.nodes[edge.tail], sketch.nodes[edge.head]
        if edge.slide is None or tail is None or head is None or tail == head:
            continue
        if sketch.rotations[edge.frame] is None:
            sketch.rotations[edge.frame] = (head - tail) / abs(head - tail) * complex(sketch.vectors.d[k]).conjugate()
            return True
    return False


def _fit(sketch: Sketch, geometry: Geometry, frame: int) -> complex:
    """Direction of a class as the least-squares fit to all points drawn on its links; 0 of fewer than two."""
    graph, nodes, vectors, total = sketch.graph, sketch.nodes, sketch.vectors, 0j
    for body, (its_frame, _) in graph.bodies.items():
        if its_frame != frame:
            continue
        pairs = [
            (complex(geometry.local(body, point, {})) * vectors.offsets[body], place)
            for owner, point in graph.points
            if owner == body and (place := nodes[graph.node(point)]) is not None
        ]
        if len(pairs) > 1:
            total += fit(*zip(*pairs, strict=True))
    for k, edge in enumerate(graph.edges):
        tail, head = nodes[edge.tail], nodes[edge.head]
        if edge.frame == frame and edge.slide in graph.telescopic and tail is not None and head is not None:
            total += (head - tail) * complex(vectors.d[k]).conjugate()
    return total


def side(group: Group, a: Vector, b: Vector) -> tuple[Value, Value]:
    """On which side of its dividing line a dyad is, by the columns of its loop, and what that is compared with.

    Both are areas; the first is positive in assembly +1.
    """
    if group.form == "two angles":
        return cross(a + b, a), np.abs(a + b) * np.minimum(np.abs(a), np.abs(b))
    return cross(b, a) if group.form == "angle and turning slide" else cross(a, b), np.abs(a)


def deciding_joints(graph: Graph, group: Group) -> tuple[str, ...]:
    """Names of the joints whose place the assembly mode of a group chooses, or of its slides where it has no joints."""
    ends = {graph.nodes[node] for loop in group.loops for node in (loop.start, loop.end)}
    names = [name for name in graph.joined(group.edges) if name not in ends]
    return tuple(names) or tuple(graph.slides[slide] for slide in group.slides)

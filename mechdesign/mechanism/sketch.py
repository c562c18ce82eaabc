"""The sketch: rough places of points, from which assembly modes, drive values and starting guesses are read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdesign.errors import MechanismError
from mechdesign.mechanism.algebra import cross, dot
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Graph
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.structure import Group, Structure

# A joint this near to its dividing line, as a fraction of the distances around it, chooses no side.
UNDECIDED = 0.01
SKETCH = "mechanism.sketch"
# Forms of groups that have one assembly, or one that is searched for.
_WITHOUT_MODE = ("place", "newton", "two slides")


@dataclass(frozen=True)
class Sketch:
    """World position of each node and rotation of each angle class, `None` where the sketch does not tell."""

    graph: Graph
    geometry: Geometry
    nodes: list[complex | None]
    rotations: list[complex | None]

    def lay_along_slide(self) -> bool:
        """Lay a class that nothing else shows along one of its slides, taken as positive; False where there is none."""
        for edge, d in zip(self.graph.edges, self.geometry.nominal.d, strict=True):
            tail, head = self.nodes[edge.tail], self.nodes[edge.head]
            if edge.slide is None or tail is None or head is None or tail == head:
                continue
            if self.rotations[edge.frame] is None:
                self.rotations[edge.frame] = (head - tail) / abs(head - tail) * complex(d).conjugate()
                return True
        return False

    def fit(self, frame: int) -> complex:
        """Direction of a class as the least-squares fit to all points drawn on its links; 0 of fewer than two."""
        total = 0j
        for body, (its_frame, _) in self.graph.bodies.items():
            if its_frame != frame:
                continue
            pairs = [
                (complex(self.geometry.local(body, point, {})) * self.geometry.nominal.offsets[body], place)
                for owner, point in self.graph.points
                if owner == body and (place := self.nodes[self.graph.node(point)]) is not None
            ]
            if len(pairs) > 1:
                middle = [sum(part, 0j) / len(pairs) for part in zip(*pairs, strict=True)]
                total += sum(((place - middle[1]) * (local - middle[0]).conjugate() for local, place in pairs), 0j)
        for k, edge in enumerate(self.graph.edges):
            tail, head = self.nodes[edge.tail], self.nodes[edge.head]
            if edge.frame == frame and edge.slide in self.graph.telescopic and tail is not None and head is not None:
                total += (head - tail) * complex(self.geometry.nominal.d[k]).conjugate()
        return total

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
            if group.form not in _WITHOUT_MODE
            for k, _ in group.loops[0].edges
            if structure.ties[structure.edges[k].frame].root in group.angles
            for node in (structure.edges[k].tail, structure.edges[k].head)
            if self.nodes[node] is None
        }
        if missing:
            names, one = ", ".join(f"'{self.graph.nodes[node]}'" for node in sorted(missing)), len(missing) == 1
            what, them = (f"point {names} is", "it") if one else (f"points {names} are", "them")
            raise MechanismError(f"{what} needed to choose the assembly; add {them} to the sketch", SKETCH)
        return tuple(self._mode(structure, group) for group in structure.groups)

    def _mode(self, structure: Structure, group: Group) -> int:
        if group.form in _WITHOUT_MODE:
            return 0
        (loop,) = group.loops
        spans = dict.fromkeys(group.angles, 0j)
        for k, sign in loop.edges:
            edge = structure.edges[k]
            root = structure.ties[edge.frame].root
            if root in spans:
                tail, head = self.nodes[edge.tail], self.nodes[edge.head]
                assert tail is not None
                assert head is not None
                spans[root] += sign * (head - tail)
        if group.form == "two angles":
            first, second = spans.values()
            side, size = cross(first + second, first), abs(first + second) * min(abs(first), abs(second))
            ends = [self.graph.nodes[node] for node in (loop.start, loop.end)]
            line = f"the line {'-'.join(ends)}" if ends[0] != ends[1] and ":" not in "".join(ends) else "the line"
        else:
            (span,), (slide,) = spans.values(), group.slides
            k, sign = next((k, sign) for k, sign in loop.edges if structure.edges[k].slide == slide)
            turn = self.rotations[structure.edges[k].frame]
            # Unknown only where the whole link is drawn at one place, which decides nothing whatever the direction.
            direction = sign * complex(self.geometry.nominal.d[k]) * (1.0 if turn is None else turn)
            side, size = dot(span, direction if group.form == "angle and turning slide" else -direction), abs(span)
            line = f"the perpendicular to slide '{self.graph.slides[slide]}'"
        if abs(side) <= UNDECIDED * size:
            names = " or ".join(f"'{name}'" for name in deciding_joints(self.graph, group))
            raise MechanismError(
                f"{names} lies within 1 % of {line} that divides the two assemblies; draw it clearly on one side",
                SKETCH,
            )
        return 1 if side > 0 else -1

    def value(self, coordinate: Coordinate) -> float | None:
        """Value of a drive as drawn (radians), or `None` where the sketch does not tell."""
        if coordinate.kind == "angle":
            turns = []
            for body in (coordinate.body, coordinate.reference):
                turn = self.rotations[self.graph.bodies[body][0]]
                if turn is None:
                    return None
                turns.append(turn * self.geometry.nominal.offsets[body])
            return float(np.angle(turns[0] * np.conj(turns[1])))
        k, edge = next((k, e) for k, e in enumerate(self.graph.edges) if e.slide == coordinate.slide)
        tail, head, turn = self.nodes[edge.tail], self.nodes[edge.head], self.rotations[edge.frame]
        if tail is None or head is None or turn is None:
            return None
        w, d = complex(self.geometry.nominal.w[k]), complex(self.geometry.nominal.d[k])
        return float(dot(head - tail - w * turn, d * turn))

    def unknowns(self, structure: Structure) -> list[float]:
        """Angles and slides of the groups without a closed form as drawn: where Newton's method starts."""
        found: list[float] = []
        for group in (structure.groups[index] for index in structure.unknowns):
            for root in group.angles:
                turn = self.rotations[root] if root < self.graph.classes else None
                if turn is None:
                    link = next((body for body, (frame, _) in self.graph.bodies.items() if frame == root), "?")
                    message = f"the points of link '{link}' are needed as a start; add them to the sketch"
                    raise MechanismError(message, SKETCH)
                found.append(float(np.angle(turn)))
            for slide in group.slides:
                value = self.value(Coordinate("", "slide", "length", slide=slide))
                if value is None:
                    raise MechanismError(
                        f"the ends of '{self.graph.slides[slide]}' are needed as a start; add them to the sketch",
                        SKETCH,
                    )
                found.append(value)
        return found


def locate(description: Description, graph: Graph, geometry: Geometry) -> Sketch:
    """Place whole links from the points drawn, and further points from the links so placed."""
    nodes: list[complex | None] = [None] * len(graph.nodes)
    rotations: list[complex | None] = [None] * graph.classes
    nodes[0], rotations[0] = 0j, 1 + 0j
    vectors = geometry.nominal
    for k, name in enumerate(graph.nodes):
        if name in description.sketch:
            nodes[k] = description.sketch[name]
    for edge, w in zip(graph.edges, vectors.w, strict=True):
        if edge.frame == 0 and edge.slide is None and edge.tail == 0:
            nodes[edge.head] = complex(w)
    sketch, changed = Sketch(graph, geometry, nodes, rotations), True
    while changed:
        changed = False
        for frame in range(1, graph.classes):
            if rotations[frame] is None:
                fit = sketch.fit(frame)
                if abs(fit) > 0:
                    rotations[frame] = fit / abs(fit)
                    changed = True
        for edge, w in zip(graph.edges, vectors.w, strict=True):
            turn = rotations[edge.frame]
            if edge.slide is None and turn is not None:
                tail, head = nodes[edge.tail], nodes[edge.head]
                if tail is not None and head is None:
                    nodes[edge.head] = tail + complex(w) * turn
                    changed = True
                elif head is not None and tail is None:
                    nodes[edge.tail] = head - complex(w) * turn
                    changed = True
        changed = changed or sketch.lay_along_slide()
    return sketch


def deciding_joints(graph: Graph, group: Group) -> tuple[str, ...]:
    """Names of the joints whose place the assembly mode of a group chooses; those of slides where it has no other."""
    ends = {graph.nodes[node] for loop in group.loops for node in (loop.start, loop.end)}
    names = [name for name in graph.joined(group.edges) if name not in ends]
    return tuple(names) or tuple(graph.slides[slide] for slide in group.slides)

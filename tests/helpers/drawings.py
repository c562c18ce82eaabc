"""Drawings read back: a small reader of DXF, areas of outlines with arcs, and distances of convex shapes."""

from __future__ import annotations

import itertools
import math


def entities(text):
    """Entities of a DXF file as mappings of codes to values; the vertices of a polyline are listed in it."""
    words = (1, 5, 8, 100, 330)
    lines = text.split("\n")
    pairs = [(int(code), value) for code, value in zip(lines[0:-1:2], lines[1::2], strict=True)]
    begin = next(k for k, pair in enumerate(pairs) if pair == (2, "ENTITIES")) + 1
    found = []
    for code, value in pairs[begin : pairs.index((0, "ENDSEC"), begin)]:
        if code == 0:
            current = {"kind": value, **({"vertices": []} if value == "LWPOLYLINE" else {})}
            found.append(current)
        elif current["kind"] == "LWPOLYLINE" and code in (10, 20, 42):
            if code == 10:
                current["vertices"].append({})
            current["vertices"][-1][code] = float(value)
        else:
            current[code] = value if code in words else float(value)
    return found


def at(entity):
    """Place of an entity."""
    return complex(entity[10], entity[20])


def area(polyline):
    """Area of a closed polyline with arcs: the polygon's, and the segment of the circle at each arc."""
    corners = [at(vertex) for vertex in polyline["vertices"]]
    total = 0.0
    for vertex, a, b in zip(polyline["vertices"], corners, [*corners[1:], corners[0]], strict=True):
        total += (a.conjugate() * b).imag / 2
        bulge = vertex.get(42, 0.0)
        if bulge:
            angle = 4 * math.atan(bulge)
            radius = abs(b - a) / (2 * abs(math.sin(angle / 2)))
            total += math.copysign(radius**2 * (abs(angle) - math.sin(abs(angle))) / 2, bulge)
    return total


def parts(text):
    """Parts of a DXF of parts by the name that is engraved: outline, holes (centre, diameter), slots."""
    found = entities(text)
    cut = [entity for entity in found if entity[8] == "cut"]
    outlines = {}
    for name in (entity for entity in found if entity["kind"] == "TEXT" and entity[8] == "engrave"):
        around = [e for e in cut if e["kind"] == "LWPOLYLINE" and _holds(e, complex(name[11], name[21]))]
        outlines[name[1]] = max(around, key=area)
    result = {}
    for name, outline in outlines.items():
        holes = [(at(e), 2 * e[40]) for e in cut if e["kind"] == "CIRCLE" and _holds(outline, at(e))]
        slots = [
            e for e in cut if e["kind"] == "LWPOLYLINE" and e is not outline and _holds(outline, at(e["vertices"][0]))
        ]
        result[name] = outline, holes, slots
    return result


def _holds(polyline, place):
    places = [at(vertex) for vertex in polyline["vertices"]]
    return min(p.real for p in places) <= place.real <= max(p.real for p in places) and min(
        p.imag for p in places
    ) <= place.imag <= max(p.imag for p in places)


def distance(one, other):
    """Distance of two convex polygons given by all their points, 0 where they overlap: side by side, corner by side."""
    if any(_inside(p, other) for p in one) or any(_inside(p, one) for p in other):
        return 0.0
    sides = [[*itertools.combinations(points, 2)] or [(points[0], points[0])] for points in (one, other)]
    if any(_crosses(*a, *b) for a in sides[0] for b in sides[1]):
        return 0.0
    return min(
        min(_to_side(p, *side) for p in one for side in sides[1]),
        min(_to_side(p, *side) for p in other for side in sides[0]),
    )


def _cross(a, b):
    return (a.conjugate() * b).imag


def _inside(place, points):
    return any(
        all(_cross(b - a, place - a) * _cross(c - a, b - a) <= 0 for a, b, c in ((p, q, r), (q, r, p), (r, p, q)))
        and _cross(q - p, r - p) != 0
        for p, q, r in itertools.combinations(points, 3)
    )


def _crosses(a, b, c, d):
    return _cross(b - a, c - a) * _cross(b - a, d - a) < 0 and _cross(d - c, a - c) * _cross(d - c, b - c) < 0


def _to_side(place, a, b):
    along = b - a
    share = 0.0 if along == 0 else min(max(((place - a) * along.conjugate()).real / abs(along) ** 2, 0.0), 1.0)
    return abs(place - a - share * along)

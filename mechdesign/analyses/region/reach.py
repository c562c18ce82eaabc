"""How far a point can get at most: from the lengths of links, strokes and limits of distance alone."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.region.rays import Designs
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.model import Term
from mechdesign.numerics.arrays import Complexes, Flags, Floats

# A box is drawn wider by this share, so that rounding leaves nothing outside.
ROOM = 1e-6


def box(designs: Designs) -> tuple[Complexes, Complexes, Flags]:
    """Corners of a box around the region of each design, shape (designs,), and whether it is known to hold all of it.

    Every point lies in a box. One pinned to another by a link is no farther from it than the link is long, and one that
    slides along the ground no farther than its stroke. Where nothing bounds the point, the box is a guess about its
    place in the sketch: the sum of all lengths.
    """
    field, count = designs.field, designs.count
    mechanism = field.mechanism
    graph, vectors = mechanism.graph, mechanism.geometry.vectors(designs.places)
    low, high = np.full((2, len(graph.nodes), count), -np.inf), np.full((2, len(graph.nodes), count), np.inf)
    low[:, 0], high[:, 0] = 0.0, 0.0
    places = {**mechanism.nominal, **designs.places}
    strokes = {b.coordinate.slide: (b.minimum, b.maximum) for b in mechanism.bounds if b.coordinate.kind == "slide"}

    def value(term: Term) -> Value:
        return places[term] if isinstance(term, str) else term

    # Steps from one node to another: the least and largest in x and y.
    steps: list[tuple[int, int, Floats, Floats]] = []
    for edge, w, d in zip(graph.edges, vectors.w, vectors.d, strict=True):
        least, most = (np.full(count, np.inf * sign) for sign in (-1, 1))
        if edge.slide is not None:
            for end, term in zip((least, most), strokes.get(edge.slide, (None, None)), strict=True):
                if term is not None:
                    end[:] = value(term)
            if edge.slide in graph.telescopic:
                least = np.maximum(least, 0.0)
        along = np.broadcast_to(np.asarray(w, dtype=complex), (count,))
        if edge.frame:
            size = np.abs(along)
            if edge.slide is not None:
                size = size + np.maximum(np.abs(least), np.abs(most))
            steps.append((edge.tail, edge.head, np.stack([-size, -size]), np.stack([size, size])))
            continue
        both = np.stack([along.real, along.imag])
        if edge.slide is None:
            steps.append((edge.tail, edge.head, both, both))
        else:
            turn = np.broadcast_to(np.asarray(d, dtype=complex), (count,))
            with np.errstate(invalid="ignore"):
                ends = np.stack([np.stack([turn.real, turn.imag]) * end for end in (least, most)])
            ends = np.where(np.isnan(ends), 0.0, ends)
            steps.append((edge.tail, edge.head, both + ends.min(axis=0), both + ends.max(axis=0)))
    for bound in mechanism.bounds:
        if bound.coordinate.kind == "distance" and bound.maximum is not None:
            size = np.abs(np.broadcast_to(np.asarray(value(bound.maximum), dtype=float), (count,)))
            steps.append((bound.coordinate.node, bound.coordinate.other, np.stack([-size] * 2), np.stack([size] * 2)))
    for _ in graph.nodes:
        for tail, head, least, most in steps:
            low[:, head] = np.maximum(low[:, head], low[:, tail] + least)
            high[:, head] = np.minimum(high[:, head], high[:, tail] + most)
            low[:, tail] = np.maximum(low[:, tail], low[:, head] - most)
            high[:, tail] = np.minimum(high[:, tail], high[:, head] - least)
    node = field.outputs[0].node
    bounded = np.isfinite(low[:, node]).all(axis=0) & np.isfinite(high[:, node]).all(axis=0)
    least, most = (np.where(bounded, side[:, node], 0.0) for side in (low, high))
    corner, other = least[0] + 1j * least[1], most[0] + 1j * most[1]
    sketch = mechanism.sketch_configuration
    drawn = complex(*(float(sketch.value(c)) for c in field.outputs[:2]))
    guess = sum(float(np.abs(z)) for z in sketch.nodes) + sum(np.abs(w) for w in vectors.w)
    guess = np.broadcast_to(np.asarray(guess, dtype=float), (count,))
    corner = np.where(bounded, corner, drawn - guess * (1 + 1j))
    other = np.where(bounded, other, drawn + guess * (1 + 1j))
    middle, size = 0.5 * (corner + other), 0.5 * (other - corner)
    # Where dimensions cannot close at all the corners are exchanged, or one.
    least = 1e-9 * guess
    size = np.maximum(size.real * (1 + ROOM), least) + 1j * np.maximum(size.imag * (1 + ROOM), least)
    return middle - size, middle + size, bounded

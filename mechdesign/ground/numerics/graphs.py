"""Matching of equations and unknowns, the smallest sets of equations that must be solved together, and pieces.

Source: Dulmage and Mendelsohn, "Coverings of bipartite graphs", Canadian Journal of Mathematics 10 (1958).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Iterable, Sequence
from typing import TypeVar

Node = TypeVar("Node", bound=Hashable)


def pieces(sets: Iterable[Collection[Node]]) -> list[set[Node]]:
    """The pieces into which what the sets hold together falls, in the order of their first sets."""
    whole: list[set[Node]] = []
    for some in sets:
        touching = [piece for piece in whole if not piece.isdisjoint(some)]
        if touching:
            touching[0].update(some, *touching[1:])
            whole = [piece for piece in whole if piece not in touching[1:]]
        else:
            whole.append(set(some))
    return whole


def perfect_matching(rows: Sequence[Sequence[int]], columns: int) -> list[int] | None:
    """A column for each row, all different, of those that the row lists; None if there is no such choice.

    Columns are numbered below `columns`. Each row is added by a shortest augmenting path.
    """
    owner = [-1] * columns
    matched = [-1] * len(rows)
    for start in range(len(rows)):
        reached_from: dict[int, int] = {}
        queue = [start]
        free = -1
        for row in queue:
            for column in rows[row]:
                if column in reached_from:
                    continue
                reached_from[column] = row
                if owner[column] < 0:
                    free = column
                    break
                queue.append(owner[column])
            if free >= 0:
                break
        else:
            return None
        while free >= 0:
            row = reached_from[free]
            owner[free], matched[row], free = row, free, matched[row]
    return matched


def components(arcs: Sequence[tuple[int, int]], count: int) -> list[list[int]]:
    """Strongly connected components of `count` nodes, each after those that its arcs lead to.

    The nodes of a component reach the same nodes, kept as the bits of a whole number, and strictly more than the nodes
    of components that it leads to.
    """
    ahead: list[list[int]] = [[] for _ in range(count)]
    for a, b in arcs:
        ahead[a].append(b)
    reached = [1 << node for node in range(count)]
    order, before = list(range(count)), [0] * count
    while reached != before:
        before = [*reached]
        for node in order:
            for other in ahead[node]:
                reached[node] |= reached[other]
        order.reverse()
    members: dict[int, list[int]] = defaultdict(list)
    for node, bits in enumerate(reached):
        members[bits].append(node)
    return [members[bits] for bits in sorted(members, key=lambda bits: (bits.bit_count(), members[bits][0]))]

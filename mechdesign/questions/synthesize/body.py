"""Linkages that guide a body through positions, or make a function: pairs of dyads.

A function is a body too: the output link, as one sees it from the input link, moves with the coupler as a dyad.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.questions.synthesize import dyads
from mechdesign.questions.synthesize.declared import (
    CONCHOID,
    FOUR_BAR,
    INVERTED,
    INVERTED_TRAMMEL,
    SLIDER_CRANK,
    TRAMMEL,
)
from mechdesign.questions.synthesize.dyads import GUIDE, LINK, SLIDE, Dyads
from mechdesign.questions.synthesize.kinds import Kind, kind_of
from mechdesign.questions.synthesize.schema import SynthesisSection
from mechdesign.questions.synthesize.sites import Site

_PAIRS = {
    (LINK, LINK): FOUR_BAR, (LINK, SLIDE): SLIDER_CRANK, (LINK, GUIDE): INVERTED,
    (SLIDE, SLIDE): TRAMMEL, (GUIDE, GUIDE): INVERTED_TRAMMEL, (SLIDE, GUIDE): CONCHOID,
}  # fmt: skip
# By how many wishes each kind may be joined to frame and body: to a line by one, to a place by two; a slide, which
# crosses every line, runs through a place by one and has a direction by another.
_GRADES = {LINK: ((0, 1, 2), (0, 1, 2)), SLIDE: ((0, 1, 2), (0, 2)), GUIDE: ((0, 2), (0, 1, 2))}
# Samples of each way to share out the wishes, and of each subset of more positions.
WISHES, _FEW = 240, 4
# Subsets of five of more positions, whose dyads are starts.
_SUBSETS = 60
_ROUNDS = 40
# Rotations that differ by less are the same.
_STILL = 1e-9
# Dyads that differ by less than this part of the task are one.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Positions:
    """Positions of a body: places of its origin, x + i y, and rotations, unit complex numbers."""

    places: Complexes
    rotations: Complexes

    @property
    def centre(self) -> complex:
        """The middle of the places."""
        return complex(self.places.mean())

    @property
    def shifts(self) -> bool:
        """Whether the body only shifts."""
        return bool(np.abs(self.rotations - self.rotations[0]).max() < _STILL)

    @property
    def poles(self) -> Complexes:
        """The points about which the body could turn from a position into a later one; nan where it shifts."""
        first, second = np.triu_indices(len(self.places), 1)
        turned = self.rotations[second] / self.rotations[first]
        with np.errstate(all="ignore"):
            places = (self.places[second] - turned * self.places[first]) / (1 - turned)
        return np.asarray(np.where(np.abs(1 - turned) > _STILL, places, np.nan))

    @property
    def straight(self) -> bool:
        """Whether the body only shifts along a line, by more than two positions."""
        about = self.places - self.centre
        along = abs((about**2).sum()) > (1 - _STILL) * (np.abs(about) ** 2).sum()
        return bool(len(about) > 2 and self.shifts and along)

    @property
    def remark(self) -> str:
        """What guides the body more simply than a linkage, or in what way a special one; empty for other tasks."""
        if self.straight:
            return "the body shifts along a line, on which a slide alone guides it"
        if self.shifts:
            return "the body only shifts: two links that guide it are parallel, of one length" * (len(self.places) > 2)
        pole, turns = self.poles.mean(), np.ptp(self.poles.real) + np.ptp(self.poles.imag) < _SAME * self.size
        if len(self.places) < 3 or not turns:
            return ""
        return f"the body turns about ({pole.real:.4g}, {pole.imag:.4g}), and a pivot there alone guides it"

    @property
    def size(self) -> float:
        """The greatest extent of the places along x or y; 1 where the body only turns."""
        extent = max(np.ptp(self.places.real), np.ptp(self.places.imag))
        return float(extent) if extent > 0 else 1.0


@dataclass(frozen=True, eq=False)
class Candidates:
    """Linkages of a kind for a task, and the value of the drive at each of its positions (radians or lengths)."""

    kind: Kind
    values: Floats  # shape (count, places)
    angles: Floats  # shape (count, positions)


def choices(
    task: Positions,
    frame: Site,
    body: Site,
    random: np.random.Generator,
    *,
    refined: bool = True,
    within_reach: bool = False,
) -> tuple[list[Dyads], list[int]]:
    """Dyads through all positions of a body, those of each kind, and how many wishes these leave to links.

    What positions leave free is sampled in the sites of frame and body, which dyads may miss; what is too much is
    met by least squares, perhaps with pivots within reach, or without `refined` by some of them. A single given point
    is that of one dyad, so that there are two numbers of wishes.
    """
    centre, size = task.centre, task.size
    scaled, parts, spare = Positions((task.places - centre) / size, task.rotations), list[Dyads](), list[int]()
    for one, other in product(frame.around, body.around):
        sites = one.scaled(centre, size), other.scaled(0j, size)
        spare.append(_known(LINK, scaled)[1] - sum(_needs(LINK, sites)))
        if spare[-1] < 0:
            near = (sites[0].within_reach, sites[1]) if within_reach else sites
            starts = _of_subsets(scaled, near, random)
            parts += [_refined(part, scaled, near) for part in starts] if refined else starts
        else:
            parts += _exact(scaled, sites, random, WISHES)
    found = [_joined([part for part in parts if part.kind == kind]) for kind in _GRADES]
    return [
        replace(part, pivot=part.pivot * size + centre, pin=part.pin * size, length=part.length * size)
        for part in found
    ], spare


def told(what: str, spare: Sequence[int], real: str, most: str) -> str:
    """How complete a list is: `what` is met, `real` says how many there are, and `most` how many there can be."""
    if min(spare) < 0:
        return f"{what} are met by least squares"
    return f"{real} from {WISHES} samples of each choice" if max(spare) > 0 else f"{real} {most}"


def _known(kind: str, task: Positions) -> tuple[Floats, int]:
    """What positions tell of a kind of dyad as independent rows, and how many wishes they leave."""
    known = dyads.independent(np.concatenate([dyads.absent(kind), dyads.rows(task.places, task.rotations)]))
    if kind != LINK:
        return known, 7 - len(known)
    # A body that only shifts has links where its places lie on a circle.
    return known, -1 if task.shifts and len(known) > 3 else dyads.EXACTLY - len(known)


def _needs(kind: str, sites: tuple[Site, Site]) -> tuple[int, int]:
    """How many wishes of a dyad the sites of frame and body are."""
    frame, body = (sum(site.fixed) for site in sites)
    return (frame // 2 if kind == SLIDE else frame), (body // 2 if kind == GUIDE else body)


def _exact(task: Positions, sites: tuple[Site, Site], random: np.random.Generator, count: int) -> list[Dyads]:
    """Dyads through all positions, with so many samples of each way to share out the wishes that these leave."""
    parts = list[Dyads]()
    for kind, grades in _GRADES.items():
        (known, freedom), needs = _known(kind, task), _needs(kind, sites)
        for shares in product(*grades):
            if sum(shares) != freedom or shares[0] < needs[0] or shares[1] < needs[1]:
                continue
            some = count if shares != needs else max(1, *(len(site.given) for site in sites))
            wishes = [_wishes(kind, side, share, site, random, some)
                      for side, share, site in zip((dyads.FRAME, dyads.BODY), shares, sites, strict=True)]  # fmt: skip
            rows = np.concatenate([np.broadcast_to(known, (some, *known.shape)), *wishes], axis=1)
            parts += dyads.dyads(rows).values()
        # That the one point of a slide lies on a line is no linear wish.
        side, site = (dyads.FRAME, sites[0]) if kind == GUIDE else (dyads.BODY, sites[1])
        if kind != LINK and freedom == 1 and sum(needs) == 1 == sum(site.fixed):
            normal, place = site.normals(random, 1), site.samples(random, 1)
            parts += dyads.sliding(side, known, normal[0], place[0]).values()
    return parts


def _wishes(kind: str, side: int, share: int, site: Site, random: np.random.Generator, count: int) -> Floats:
    """Rows of so many wishes of a dyad for its place in frame or body, shape (count, rows, 8)."""
    if not share:
        return np.empty((count, 0, 8))
    places = site.samples(random, count)
    if kind == (SLIDE if side == dyads.FRAME else GUIDE):
        turned = dyads.on_lines(side, site.normals(random, count), 0 * places)
        return np.concatenate([dyads.through(side, places), turned[:, : share - 1]], axis=1)
    if share == 1:
        return dyads.on_lines(side, site.normals(random, count), places)
    return dyads.at_places(kind, side, places)


def _joined(parts: Sequence[Dyads]) -> Dyads:
    """Dyads of one kind together, each once."""
    whole = Dyads(parts[0].kind, *(np.concatenate([getattr(part, name) for part in parts])
                                   for name in ("pivot", "pin", "normal", "length")))  # fmt: skip
    keys = np.stack([whole.pivot.real, whole.pivot.imag, whole.pin.real, whole.pin.imag], axis=1)
    rows = [*enumerate(map(tuple, np.round(keys / _SAME).tolist()))]
    return whole.take(sorted({key: row for row, key in reversed(rows)}.values()))


def _of_subsets(task: Positions, sites: tuple[Site, Site], random: np.random.Generator) -> list[Dyads]:
    """Dyads of each kind through subsets of the positions, from which those with the least squares are looked for."""
    count = len(task.places)
    size = min(count, 3 if task.shifts else dyads.EXACTLY - sum(_needs(LINK, sites)))
    every = list(combinations(range(count), size)) if count < 12 else [
        tuple(random.choice(count, size, replace=False)) for _ in range(_SUBSETS)
    ]  # fmt: skip
    chosen = [list(every[k]) for k in random.permutation(len(every))[:_SUBSETS]]
    parts = [part for some in chosen
             for part in _exact(Positions(task.places[some], task.rotations[some]), sites, random, _FEW)]  # fmt: skip
    # A pin whose way is nearly straight may as well slide.
    link = _joined([part for part in parts if part.kind == LINK])
    for kind, seen, pin in ((SLIDE, task, link.pin), (GUIDE, _from_body(task), link.pivot)):
        ways = seen.places + seen.rotations * pin[:, None]
        about = ways - ways.mean(axis=1, keepdims=True)
        normal = 1j * np.exp(0.5j * np.angle((about**2).sum(axis=1)))
        line = (ways.mean(axis=1) * np.conj(normal)).real * normal
        sliding = Dyads(SLIDE, line, pin, normal, 0.0 * link.length)
        parts.append(sliding if kind == SLIDE else Dyads(GUIDE, pin, line, normal, sliding.length))
    return [_joined([part for part in parts if part.kind == kind]) for kind in _GRADES]


def _from_body(task: Positions) -> Positions:
    """The frame as the body sees it."""
    return Positions(-task.places / task.rotations, 1 / task.rotations)


def _refined(start: Dyads, task: Positions, sites: tuple[Site, Site]) -> Dyads:
    """Dyads with the least squares of the errors of length, or of the distance from the line, by Gauss and Newton.

    Pivots and pins stay in the sites of frame and body.
    """
    frame, body = sites
    if not len(start):
        return start
    if start.kind == GUIDE:
        # Seen from the body the pivot of the frame moves along a slide.
        other = _refined(Dyads(SLIDE, start.pin, start.pivot, start.normal, start.length), _from_body(task),
                         (body, frame))  # fmt: skip
        return Dyads(GUIDE, other.pin, other.pivot, other.normal, other.length)
    p, r, links = task.places, task.rotations, start.kind == LINK
    normal, length, through = start.normal, start.length, all(frame.fixed)
    pin, pivot = body.nearest(start.pin), start.pivot if links else frame.crossed(start.pivot, normal)
    if links or through:
        pivot = frame.nearest(pivot)
    for _ in range(_ROUNDS):
        reach = p + r * pin[:, None] - pivot[:, None]
        size = np.maximum(np.abs(reach), np.finfo(float).tiny)
        along = np.conj(reach) / size if links else np.broadcast_to(np.conj(normal)[:, None], reach.shape)
        wrong: Floats = size - length[:, None] if links else (along * reach).real
        by_pin, by_pivot = along * r * body.axis, -along * frame.axis
        parts = [by_pin.real, -by_pin.imag, *((by_pivot.real, -by_pivot.imag) if links else [(along * reach).imag]),
                 -np.ones_like(size)]  # fmt: skip
        matrix = np.stack(parts, 2)
        slope = np.einsum("npi,np->ni", matrix, wrong)
        free = np.ones_like(slope)
        free[:, :2] = body.free(pin, slope[:, :2])
        if links:
            free[:, 2:4] = frame.free(pivot, slope[:, 2:4])
        else:
            free[:, 3] = not through
        matrix, slope = matrix * free[:, None], slope * free
        square = np.einsum("npi,npj->nij", matrix, matrix)
        square[:, range(square.shape[1]), range(square.shape[1])] += 1e-12 * (1 + np.einsum("nii->n", square)[:, None])
        step = -np.linalg.solve(square, slope[..., None])[..., 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        pin = body.nearest(pin + body.axis * (step[:, 0] + 1j * step[:, 1]))
        if links:
            pivot = frame.nearest(pivot + frame.axis * (step[:, 2] + 1j * step[:, 3]))
            length = length + step[:, 4]
        else:
            normal = normal * np.exp(1j * step[:, 2])
            pivot = pivot + step[:, 3] * normal
    if not links:
        # The nearest point of a line to the origin tells those that are the same.
        pivot = (np.conj(normal) * pivot).real * normal
    return Dyads(start.kind, pivot, pin, normal, length)


def pairs(
    task: Positions, found: Sequence[Dyads], sites: tuple[Site, Site], lengths: Mapping[str, tuple[float, float]],
    section: SynthesisSection, random: np.random.Generator, most: int,
) -> Iterator[tuple[Candidates, int]]:  # fmt: skip
    """Linkages of two dyads each with links of these lengths, at most so many of a kind, and how many there are."""
    wanted = section.kinds or tuple(_PAIRS.values())
    by_kind = {part.kind: part for part in found}
    for (first, second), name in _PAIRS.items():
        if name not in wanted or (section.slide and first == second == LINK):
            continue
        one, other = by_kind[first], by_kind[second]
        good = _together(one, other, sites)
        for link, part, axis in (("crank", one, 1), ("rocker", other, 0)):
            if link in lengths and part.kind == LINK:
                low, high = lengths[link]
                good &= np.expand_dims((part.length >= low) & (part.length <= high), axis)
        # A pair of links may be driven by either; two slides are the same pair in both orders.
        if first == second == LINK:
            good &= ~np.eye(len(one), dtype=bool)
        elif first == second:
            # Along two slides of one direction the body is free, or jammed.
            turned = np.abs((one.normal[:, None] * np.conj(other.normal)).imag) > _SAME
            good &= np.triu(turned, 1)
        every = np.flatnonzero(good)
        if len(every):
            some = random.choice(every, most, replace=False) if len(every) > most else every
            a, b = np.divmod(some, len(other))
            count = len(every) // (2 if first == second == LINK else 1)
            yield _linkage(kind_of("body", name), task, one.take(a), other.take(b)), count


def _together(one: Dyads, other: Dyads, sites: tuple[Site, Site]) -> Flags:
    """Which dyads have, with which others, as many of the given points of frame and body as they have room for.

    A single one is that of a pivot, or pin, where the linkage has one.
    """
    good = np.ones((len(one), len(other)), dtype=bool)
    for site, slides, side in zip(sites, (SLIDE, GUIDE), ("pivot", "pin"), strict=True):
        if not len(site.given):
            continue
        first, second = (np.where(site.holds(places), np.abs(places[:, None] - site.given).argmin(axis=1), -1)
                         for places in (getattr(one, side), getattr(other, side)))  # fmt: skip
        if len(site.given) > 1:
            good &= (first[:, None] >= 0) & (second >= 0) & (first[:, None] != second)
        else:
            has = [(one.kind != slides or other.kind == slides), (other.kind != slides or one.kind == slides)]
            good &= (has[0] & (first[:, None] == 0)) ^ (has[1] & (second == 0))
    return good


def _linkage(kind: Kind, task: Positions, one: Dyads, other: Dyads) -> Candidates:
    """The linkages of pairs of dyads; the first is the crank, if it is a link."""
    values = np.tile(kind.nominal, (len(one), 1))

    def put(point: str, place: Complexes) -> None:
        values[:, kind[f"{point}.x"]], values[:, kind[f"{point}.y"]] = place.real, place.imag

    def turned(slide: str, normal: Complexes) -> None:
        values[:, kind[f"{slide}.direction"]] = np.angle(-1j * normal)

    put("coupler.P", np.zeros(len(one), dtype=complex))
    put("ground.O", one.pivot)
    put("ground.D", other.pivot)
    put("coupler.A", one.pin)
    put("coupler.B", other.pin)
    for part, link, rail, guide in ((one, "crank", "second_rail", "second_guide"), (other, "rocker", "rail", "guide")):
        if part.kind == LINK:
            values[:, kind[f"{link}.length"]] = part.length
        else:
            turned(rail if part.kind == SLIDE else guide, part.normal)
    if one.kind == LINK:
        seen = task.places + task.rotations * one.pin[:, None] - one.pivot[:, None]
        angles = np.angle(seen)
    else:
        angles = np.broadcast_to(np.angle(task.rotations), (len(one), len(task.places)))
    return Candidates(kind, values, angles)

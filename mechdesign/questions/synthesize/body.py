"""Linkages that guide a body through positions, or make a function: pairs of dyads.

A function is a body too: the output link, as one sees it from the input link, moves with the coupler as a dyad.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
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
from mechdesign.questions.synthesize.schema import Region, SynthesisSection

_PAIRS = {
    (LINK, LINK): FOUR_BAR, (LINK, SLIDE): SLIDER_CRANK, (LINK, GUIDE): INVERTED,
    (SLIDE, SLIDE): TRAMMEL, (GUIDE, GUIDE): INVERTED_TRAMMEL, (SLIDE, GUIDE): CONCHOID,
}  # fmt: skip
# Wishes that are sampled where positions leave a choice, for each choice.
WISHES = 240
# Subsets of five of more positions, whose dyads are starts.
_SUBSETS = 60
_ROUNDS = 40
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
    task: Positions, section: SynthesisSection, random: np.random.Generator, factor: float, *, zeros: bool = False,
    slides: bool = False,
) -> tuple[list[Dyads], str]:  # fmt: skip
    """Dyads through all positions of a body, one of each kind, and what is said of them.

    `factor` is radians in the unit of the section's angles.
    With `zeros` the pivot lies on the x axis of the frame, and the pin on that of the body unless the body slides.
    """
    centre, size = (0j if zeros or slides else task.centre), task.size
    scaled, count = Positions((task.places - centre) / size, task.rotations), len(task.places)
    fixed = [dyads.pivot_on(1j, 0.0)] * zeros + [dyads.pin_on(1j, 0.0)] * (zeros and not slides)
    if count + len(fixed) > 5:
        found = _least_squares(scaled, random, np.array(fixed).reshape(-1, 8))
        words = f"{count} positions are met by least squares"
    else:
        wishes = _wishes(count + len(fixed), section, task, random, factor)
        rows = ((np.concatenate([np.broadcast_to(fixed, (*wish.shape[:-2], len(fixed), 8)), wish], axis=-2)
                 if fixed else wish) for wish in wishes)  # fmt: skip
        parts = [dyads.dyads(scaled.places, scaled.rotations, wish) for wish in rows]
        found = [_joined([part[kind] for part in parts]) for kind in (LINK, SLIDE, GUIDE)]
        real, whole = sum(map(len, found)), count + len(fixed) == 5
        words = f"{real} real dyads of at most 4" if whole else f"{real} dyads from {WISHES} samples of each choice"
    placed = [
        replace(part, pivot=part.pivot * size + centre, pin=part.pin * size, length=part.length * size)
        for part in found
    ]
    # The line of a slide of the frame is told by its point next to the task.
    return [
        replace(part, pivot=centre + ((part.pivot - centre) * np.conj(part.normal)).real * part.normal)
        if part.kind == SLIDE else part for part in placed
    ], words  # fmt: skip


def _wishes(
    count: int, section: SynthesisSection, task: Positions, random: np.random.Generator, factor: float
) -> Iterator[Floats]:
    """Rows of wishes that leave no choice, each of shape (samples, rows, 8)."""
    if count == 5:
        yield np.empty((0, 8))
        return
    reach = section.limits.reach * task.size
    pivots = (_sampled(section.pivots, random, task.centre, reach, factor) - task.centre) / task.size
    pins = _sampled(section.pins, random, 0j, reach, factor) / task.size
    turns = np.exp(1j * random.uniform(0, np.pi, WISHES))
    free = random.normal(size=(WISHES, 5 - count, 8))
    # Of a slide w = 0, and X = 0 or A = 0 by one of the conics' points.
    yield np.concatenate([np.broadcast_to(dyads.SLIDING, (WISHES, 1, 8)), free[:, 1:]], axis=1)
    if count == 4:
        # The curve of centre points, where lines through the places that pivots may have cut it.
        for samples, on in ((pivots, dyads.pivot_on), (pins, dyads.pin_on)):
            lines = zip(turns, samples, strict=True)
            yield np.stack([on(n, float((np.conj(n) * place).real))[None] for n, place in lines])
    elif count == 3:
        yield np.stack([dyads.pivot_at(place) for place in pivots])
        yield np.stack([dyads.pin_at(place) for place in pins])
    else:
        yield np.stack([
            np.concatenate([dyads.pin_at(pin), dyads.pivot_on(n, float((np.conj(n) * place).real))[None]])
            for n, place, pin in zip(turns, pivots, pins, strict=True)
        ])  # fmt: skip


def _sampled(
    places: Sequence[tuple[float, float]] | Region | None, random: np.random.Generator, centre: complex, reach: float,
    factor: float,
) -> Complexes:  # fmt: skip
    """Places in a region, each given one equally often; where it has no end, within `reach` of a centre."""
    if places is None:
        around = np.exp(1j * random.uniform(-np.pi, np.pi, WISHES))
        return np.asarray(centre + reach * np.sqrt(random.uniform(size=WISHES)) * around)
    if not isinstance(places, Region):
        given = np.array([complex(x, y) for x, y in places])
        return np.asarray(np.resize(given, WISHES))
    if places.through is not None:
        along = places.along(factor)
        nearest = complex(*places.through) + ((centre - complex(*places.through)) * np.conj(along)).real * along
        return np.asarray(nearest + along * reach * random.uniform(-1, 1, WISHES))
    parts = []
    for ends, middle in ((places.x, centre.real), (places.y, centre.imag)):
        low, high = (
            ends if isinstance(ends, tuple) else (ends, ends) if ends is not None else (middle - reach, middle + reach)
        )
        parts.append(random.uniform(low, high, WISHES) if high > low else np.full(WISHES, low))
    return parts[0] + 1j * parts[1]


def _joined(parts: Sequence[Dyads]) -> Dyads:
    """Dyads of one kind together, each once."""
    whole = Dyads(parts[0].kind, *(np.concatenate([getattr(part, name) for part in parts])
                                   for name in ("pivot", "pin", "normal", "length")))  # fmt: skip
    keys = np.stack([whole.pivot.real, whole.pivot.imag, whole.pin.real, whole.pin.imag], axis=1)
    _, first = np.unique(np.round(keys / _SAME), axis=0, return_index=True)
    return whole.take(np.sort(first))


def _least_squares(task: Positions, random: np.random.Generator, fixed: Floats) -> list[Dyads]:
    """Dyads with the least squares of their errors, from those of subsets of five positions."""
    every = list(combinations(range(len(task.places)), 5 - len(fixed))) if len(task.places) < 12 else [
        tuple(random.choice(len(task.places), 5 - len(fixed), replace=False)) for _ in range(_SUBSETS)
    ]  # fmt: skip
    chosen = [every[k] for k in random.permutation(len(every))[:_SUBSETS]]
    parts = [dyads.dyads(task.places[list(some)], task.rotations[list(some)], fixed) for some in chosen]
    held = ([], [3], [1, 3])[len(fixed)]
    starts = {kind: _joined([part[kind] for part in parts]) for kind in (LINK, SLIDE, GUIDE)}
    if not len(fixed):
        # A pin whose way is nearly straight may as well slide.
        link = starts[LINK]
        for kind, seen, pin in ((SLIDE, task, link.pin), (GUIDE, _from_body(task), link.pivot)):
            ways = seen.places + seen.rotations * pin[:, None]
            about = ways - ways.mean(axis=1, keepdims=True)
            normal = 1j * np.exp(0.5j * np.angle((about**2).sum(axis=1)))
            line = (ways.mean(axis=1) * np.conj(normal)).real * normal
            sliding = Dyads(SLIDE, line, pin, normal, 0.0 * link.length)
            starts[kind] = sliding if kind == SLIDE else Dyads(GUIDE, pin, line, normal, sliding.length)
    return [_joined([_refined(start, task, held)]) for start in starts.values()]


def _from_body(task: Positions) -> Positions:
    """The frame as the body sees it."""
    return Positions(-task.places / task.rotations, 1 / task.rotations)


def _refined(start: Dyads, task: Positions, held: Sequence[int] = ()) -> Dyads:
    """Dyads with the least squares of the errors of length, or of the distance from the line, by Gauss and Newton.

    Of a link the unknowns `held` (x and y of pin and pivot) stay.
    """
    if not len(start):
        return start
    if start.kind == GUIDE:
        # Seen from the body the pivot of the frame moves along a slide.
        other = _refined(Dyads(SLIDE, start.pin, start.pivot, start.normal, start.length), _from_body(task))
        return Dyads(GUIDE, other.pin, other.pivot, other.normal, other.length)
    p, r = task.places, task.rotations
    pin, pivot, normal, length = start.pin, start.pivot, start.normal, start.length
    for _ in range(_ROUNDS):
        reach = p + r * pin[:, None] - pivot[:, None]
        if start.kind == LINK:
            size = np.maximum(np.abs(reach), np.finfo(float).tiny)
            along = np.conj(reach) / size
            wrong: Floats = size - length[:, None]
            parts = [(along * r).real, (along * 1j * r).real, -along.real, -along.imag, -np.ones_like(size)]
        else:
            along = np.broadcast_to(np.conj(normal)[:, None], reach.shape)
            wrong = (along * reach).real
            turn = (np.conj(1j * normal)[:, None] * (p + r * pin[:, None])).real
            parts = [(along * r).real, (along * 1j * r).real, turn, -np.ones_like(turn)]
        matrix = np.stack(parts, 2)
        matrix[..., held] = 0.0
        square = np.einsum("npi,npj->nij", matrix, matrix)
        slope = np.einsum("npi,np->ni", matrix, wrong)
        square[:, range(square.shape[1]), range(square.shape[1])] += 1e-12 * (1 + np.einsum("nii->n", square)[:, None])
        step = -np.linalg.solve(square, slope[..., None])[..., 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        pin = pin + step[:, 0] + 1j * step[:, 1]
        if start.kind == LINK:
            pivot, length = pivot + step[:, 2] + 1j * step[:, 3], length + step[:, 4]
        else:
            offset = (pivot * np.conj(normal)).real + step[:, 3]
            normal = normal * np.exp(1j * step[:, 2])
            pivot = offset * normal
    return Dyads(start.kind, pivot, pin, normal, length)


def pairs(
    task: Positions, found: Sequence[Dyads], section: SynthesisSection, random: np.random.Generator, most: int
) -> Iterator[Candidates]:
    """Linkages of two dyads each, at most so many of a kind."""
    wanted = section.kinds or tuple(_PAIRS.values())
    for (first, second), name in _PAIRS.items():
        one, other = (next(part for part in found if part.kind == kind) for kind in (first, second))
        if name not in wanted or not len(one) or not len(other) or (section.slide and SLIDE not in (first, second)
                                                                   and GUIDE not in (first, second)):  # fmt: skip
            continue
        a, b = np.divmod(np.arange(len(one) * len(other)), len(other))
        # A pair of links may be driven by either; two slides are the same pair in both orders.
        a, b = (
            (a[a != b], b[a != b]) if first == second == LINK else (a[a < b], b[a < b]) if first == second else (a, b)
        )
        if len(a) > most:
            some = np.sort(random.choice(len(a), most, replace=False))
            a, b = a[some], b[some]
        if len(a):
            yield _linkage(kind_of("body", name), task, one.take(a), other.take(b))


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

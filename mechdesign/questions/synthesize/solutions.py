"""Solutions of a task: which keep the conditions, their order, their numbers, and each as a study file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.ground.progress import NULL, Progress
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.four_bars import four_bars
from mechdesign.mechanism.mechanism import Variant
from mechdesign.questions.synthesize.declared import BODY, FOUR_BAR
from mechdesign.questions.synthesize.dyads import GUIDE, SLIDE, Dyads
from mechdesign.questions.synthesize.judging import TaskMotion
from mechdesign.questions.synthesize.kinds import Kind
from mechdesign.questions.synthesize.schema import SynthesisSection
from mechdesign.questions.synthesize.sites import Site

# Two linkages whose values differ by less than this part of their scale are one: exact ones, and others, which lie side
# by side along a valley of the error.
_SAME, _ALIKE = 1e-5, 0.02
# Most linkages of a kind and assembly that are compared one by one.
_MOST = 200
# An error below this part of the task's size is none.
EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Linkages:
    """Linkages of one kind and assembly that do a task, and how well; each array has a first axis (count,)."""

    way: TaskMotion
    errors: Floats  # at each position, shape (count, positions); infinite where it cannot be assembled

    @property
    def kind(self) -> Kind:
        """Their kind."""
        return self.way.kind

    def rms(self) -> Floats:
        """Root mean square of the errors."""
        return np.asarray(np.sqrt((self.errors**2).mean(axis=1)))

    def solution(self, row: int) -> Solution:
        """One of them."""
        way = self.way
        return Solution(
            way.kind, way.modes, way.values[row], way.angles[row], self.errors[row], way.defects[row],
            float(way.transmission[row]), bool(way.full_turn[row]), (np.flatnonzero(way.elsewhere[row]) + 1).tolist(),
        )  # fmt: skip


class Worth(NamedTuple):
    """What a linkage is worth once it is made; nan where it is not asked."""

    share: float = np.nan  # of made linkages that keep the limit
    low: float = np.nan  # ends of its interval
    high: float = np.nan
    effort: float = np.nan  # greatest effort of the drive, in the study's units


_UNJUDGED = Worth()


@dataclass(frozen=True, eq=False)
class Solution:
    """One linkage that does a task."""

    kind: Kind
    modes: tuple[int, ...]
    values: Floats  # shape (places,), angles in radians
    angles: Floats  # drive at the positions
    errors: Floats  # at the positions, infinite where it cannot be assembled
    defects: str
    transmission: float  # radians
    full_turn: bool
    elsewhere: Sequence[int]  # positions, from 1, that need another assembly
    made: Worth = _UNJUDGED

    @property
    def error(self) -> float:
        """Root mean square of the errors where it can be assembled."""
        return float(np.sqrt((self.errors[np.isfinite(self.errors)] ** 2).mean()))

    @property
    def max_error(self) -> float:
        """The largest of them."""
        return float(self.errors[np.isfinite(self.errors)].max())

    @cached_property
    def poses(self) -> Configuration:
        """Its poses at the positions."""
        return self.kind.solve(self.values[None], self.angles[None], self.modes)

    @property
    def size(self) -> float:
        """The greatest extent of its points along x or y."""
        poses = self.poses.take(np.nonzero(self.poses.valid))
        places = np.concatenate([np.broadcast_to(node, poses.shape) for node in poses.nodes])
        return float(max(np.ptp(places.real), np.ptp(places.imag)))

    @property
    def variant(self) -> Variant:
        """Its mechanism."""
        description = self.kind.mechanism.description
        places = {name: replace(description.places[name], nominal=float(value))
                  for name, value in self.kind.dimensions(self.values).items()}  # fmt: skip
        return Variant(self.kind.mechanism, replace(description, places={**description.places, **places}))

    @property
    def grashof(self) -> str:
        """Class of its first four-bar or slider-crank; empty where it has none."""
        return next((loop.type for loop in four_bars(self.variant)), "")


class Conditions:
    """What linkages must keep, and how many were dropped for each."""

    def __init__(
        self, section: SynthesisSection, centre: complex, size: float, factor: float, progress: Progress = NULL
    ) -> None:
        self.section, self.centre, self.size, self.factor, self.progress = section, centre, size, factor, progress
        far = size, section.bounds.reach, factor
        #: where the frame has room for pivots, and the body for pins
        self.sites = Site.of(section.pivots, centre, *far), Site.of(section.pins, 0j, *far)
        self.dropped: Counter[tuple[str, str]] = Counter()  #: by what was dropped, and why
        self.told: list[str] = []  #: what is found, in words

    def begun(self, kind: Kind, values: Floats, order: Ints, most: int) -> Ints:
        """Linkages, at most so many and in an order, that keep what their dimensions alone tell.

        Where none does it is the first of those that miss the fewest conditions, as the nearest.
        """
        judged = [*self._of_dimensions(kind, values)]
        kept = self.counted(judged, len(values))
        if not kept.any():
            misses = np.sum([~good for _, good in judged], axis=0)
            return order[[int(misses[order].argmin())]]
        self.dropped["linkage", f"only {most} of a kind and assembly are followed"] += max(int(kept.sum()) - most, 0)
        return np.asarray(order[kept[order]][:most])

    def kept(self, pool: Linkages) -> Flags:
        """Which linkages keep all conditions."""
        kept = np.isfinite(pool.errors).all(axis=1)
        for _, good in self._of_dimensions(pool.kind, pool.way.values):
            kept &= good
        return kept & self.counted(self._of_way(pool.way), len(pool.way))

    def missed(self, pool: Linkages) -> list[list[str]]:
        """The conditions that each linkage of a pool does not keep."""
        conditions = [*self._of_dimensions(pool.kind, pool.way.values), *self._of_way(pool.way)]
        lost = [np.flatnonzero(np.isinf(errors)) + 1 for errors in pool.errors]
        return [[reason for reason, good in conditions if not good[row]]
                + [f"it cannot be assembled at position {', '.join(map(str, at))}"] * bool(len(at))
                for row, at in enumerate(lost)]  # fmt: skip

    def placed(self, dyads: Dyads) -> Dyads:
        """The dyads that are in place in frame and body; slides told by a point that is there, if they have one."""
        frame, body = self.sites
        if dyads.kind == SLIDE:
            dyads = replace(dyads, pivot=frame.crossed(dyads.pivot, dyads.normal))
        if dyads.kind == GUIDE:
            dyads = replace(dyads, pin=body.crossed(dyads.pin, dyads.normal))
        judged = chain(
            self._of_pivots(dyads.pivot[:, None], few=len(frame.given) == 1),
            self._of_pins(dyads.pin[:, None], few=len(body.given) == 1),
        )
        return dyads.take(self.counted(judged, len(dyads), "dyad"))

    def counted(self, judged: Iterable[tuple[str, Flags]], count: int, what: str = "linkage") -> Flags:
        """Which linkages, or dyads, keep conditions; the others are counted by the first that they miss."""
        kept = np.ones(count, dtype=bool)
        for reason, good in judged:
            self.dropped[what, reason] += int((kept & ~good).sum())
            kept &= good
        return kept

    def solutions(self, pool: Linkages) -> Iterator[Solution]:
        """The best linkages of a pool that keep all conditions."""
        if not len(pool.way):
            return
        rows = np.flatnonzero(self.kept(pool))
        faulty = np.array([words != "" for words in pool.way.defects])[rows]
        errors = np.where(pool.rms() < EXACT * self.size, 0.0, pool.rms())[rows]
        best = rows[np.lexsort((-pool.way.transmission[rows], errors, faulty))][:_MOST]
        yield from (pool.solution(int(row)) for row in best)

    def _of_pivots(self, pivots: Complexes, *, few: bool = False) -> Iterator[tuple[str, Flags]]:
        """What pivots of the frame keep, shape (count, pivots); `few` are not all of a linkage."""
        frame, section = self.sites[0], self.section
        yield (
            "a pivot is too far away (limits.reach)",
            (np.abs(pivots - self.centre).max(axis=1) <= section.bounds.reach * self.size),
        )
        if section.pivots is not None and not few:
            yield "a pivot is out of place (pivots)", _in_place(frame, pivots)
        for box in section.keep_out:
            within = (np.abs(pivots.real - np.mean(box.x)) < np.ptp(box.x) / 2) & (
                np.abs(pivots.imag - np.mean(box.y)) < np.ptp(box.y) / 2
            )
            yield "a pivot lies where none may (keep_out)", ~within.any(axis=1)

    def _of_pins(self, pins: Complexes, *, few: bool = False) -> Iterator[tuple[str, Flags]]:
        """What pins of the body keep, shape (count, pins); `few` are not all of a linkage."""
        if self.section.pins is not None and not few:
            yield "a pin is out of place (pins)", _in_place(self.sites[1], pins)

    def _of_dimensions(self, kind: Kind, values: Floats) -> Iterator[tuple[str, Flags]]:
        section, links = self.section, kind.links(values)
        every = np.ones(len(values), dtype=bool)
        if section.kinds and kind.name not in section.kinds:
            yield "it is of another kind (kinds)", ~every
        if section.slide and kind.name == FOUR_BAR:
            yield "no side of the body is a slide (slide)", ~every
        yield from self._of_pivots(kind.frame(values))
        if section.pins is not None:
            x, y = (np.stack([values[:, kind[f"{BODY}.{pin}.{way}"]] for pin in "AB"], axis=1) for way in "xy")
            yield from self._of_pins(x + 1j * y)
        lengths = np.stack([*links.values()]) if links else np.ones((1, len(values)))
        ratio = np.asarray(lengths.max(axis=0) / lengths.min(axis=0))
        yield "lengths are too unequal (limits.ratio)", ratio <= section.bounds.ratio
        for name, (low, high) in section.lengths.items():
            if name in links:
                good = (links[name] >= low) & (links[name] <= high)
                yield f"{name} is too short or too long (lengths)", good
        if section.grashof and kind.name == FOUR_BAR:
            ordered = np.sort(lengths, axis=0)
            good = ordered[0] + ordered[-1] <= ordered[1:-1].sum(axis=0)
            yield "no link can turn fully (grashof)", good

    def _of_way(self, way: TaskMotion) -> Iterator[tuple[str, Flags]]:
        section = self.section
        if section.needs_turn:
            yield "the drive cannot turn fully (full_turn)", way.full_turn
        if section.transmission is not None:
            least = float(np.sin(section.transmission.at_least * self.factor))
            yield "the transmission angle is too small (transmission)", np.sin(way.transmission) >= least
        if section.defects == "dropped":
            yield "it has a defect", np.array([not words for words in way.defects], dtype=bool)


def _in_place(site: Site, places: Complexes) -> Flags:
    """Which linkages have all places, shape (count, places), in a site, and as many of the given ones as they can."""
    if not len(site.given):
        return np.asarray(site.holds(places).all(axis=1))
    near = (np.abs(places[:, :, None] - site.given) <= site.slack).any(axis=1)
    return np.asarray(near.sum(axis=1) >= min(places.shape[1], len(site.given)))


def distinct(solutions: Sequence[Solution], size: float) -> list[Solution]:
    """Solutions by their errors, each once; those with a defect behind the others."""
    ordered = sorted(solutions, key=lambda one: (one.defects != "", rounded(one.error, size), -one.transmission))
    kept: list[Solution] = []
    seen: dict[tuple[str, tuple[int, ...]], list[Floats]] = {}
    for one in ordered:
        others = seen.setdefault((one.kind.name, one.modes), [])
        scale, least = one.kind.scale(one.values, size), _SAME if one.error < EXACT * size else _ALIKE
        if not others or (np.abs(np.array(others) - one.values) / scale).max(axis=1).min() > least:
            others.append(one.values)
            kept.append(one)
    return kept


def rounded(error: float, size: float) -> float:
    """An error to four digits, so that rounding orders nothing."""
    return float(f"{clear(error, size):.4g}")


def clear(error: float, size: float) -> float:
    """An error, 0 where it is rounding beside the task's size."""
    return 0.0 if error < EXACT * size else error


def ranked(
    solutions: Sequence[Solution], weights: Mapping[str, float], size: float, most: int
) -> tuple[list[Solution], list[float]]:
    """The best solutions, at most so many, those with a defect last, and their scores from 0 to 1."""
    measures: dict[str, Callable[[Solution], float]] = {
        "error": lambda one: -rounded(one.error, size), "yield": lambda one: one.made.share,
        "transmission": lambda one: one.transmission, "size": lambda one: -one.size,
    }  # fmt: skip
    total, whole = np.zeros(len(solutions)), sum(weights.values())
    for name, weight in weights.items():
        values = np.nan_to_num(np.array([measures[name](one) for one in solutions], dtype=float), nan=-np.inf)
        known = values[np.isfinite(values)]
        low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
        share = (np.maximum(values, low) - low) / (high - low) if high > low else np.ones(len(values))
        total += weight / whole * np.where(np.isfinite(values), share, 0.0)
    places = [(one.defects != "", -round(float(score), 9)) for one, score in zip(solutions, total, strict=True)]
    # Of those that are as good, such as exact ones, the best of every kind comes first.
    turn: Counter[tuple[bool, float, str]] = Counter()
    turns = [0] * len(solutions)
    for k in sorted(range(len(solutions)), key=lambda k: -solutions[k].transmission):
        turn[*places[k], solutions[k].kind.name] += 1
        turns[k] = turn[*places[k], solutions[k].kind.name]
    order = sorted(range(len(solutions)), key=lambda k: (places[k], turns[k], -solutions[k].transmission))
    if {*weights} == {"error"}:
        # Exact ones are kept, behind others where they have a defect.
        exact = sorted(range(len(order)), key=lambda place: rounded(solutions[order[place]].error, size) > 0)
        order = [order[place] for place in sorted(exact[:most])]
    return [solutions[k] for k in order[:most]], [float(total[k]) for k in order[:most]]

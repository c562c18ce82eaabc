"""The three tasks: how each finds linkages, and how far a linkage is from it at each of its positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from mechdesign.ground.errors import StudyError, counted
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.configuration import Configuration
from mechdesign.questions.synthesize import body, paths
from mechdesign.questions.synthesize.body import Candidates, Positions
from mechdesign.questions.synthesize.bounds import Bounds, KindBounds, RangeBounds
from mechdesign.questions.synthesize.declared import BODY, FOUR_BAR, POINT, in_words
from mechdesign.questions.synthesize.dyads import LINK, Dyads
from mechdesign.questions.synthesize.exact import passing
from mechdesign.questions.synthesize.judging import in_order, passed
from mechdesign.questions.synthesize.kinds import Kind, kind_of
from mechdesign.questions.synthesize.own import OwnKind, own_kind
from mechdesign.questions.synthesize.schema import SynthesisSection
from mechdesign.questions.synthesize.sites import Site
from mechdesign.questions.synthesize.solutions import EXACT, Conditions, Linkages, Solution
from mechdesign.study import Study
from mechdesign.study.text.csv_files import read_table

# Greatest ratio of lengths of samples between given pivots.
_SAMPLED = 30.0
# Of more points than this fewer linkages are polished, down to so few; of more points than the last only
# every second, third and so on counts.
_MANY, _FEWEST, _MOST_POINTS = 40, 100, 200
# Exact linkages that differ by less are one.
_DISTINCT = 1e-5
# Most linkages of a kind whose ways are followed.
MOST = 200
# Linkages that are sampled of each kind and assembly for a path, and pairs of dyads of each kind for a body.
PATHS, OPEN_PATHS, PAIRS = 30_000, 4_000, 1_500
# Errors that differ by less than this part of the task's size are the same.
_EQUAL = 1e-6
_NONE = np.empty(0, dtype=complex)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Task:
    """What the tasks share."""

    section: SynthesisSection
    factor: float  # radians in the study's unit of angle
    centre: complex  # middle of positions and mechanism
    size: float  # by which places and errors count
    points: Complexes = field(default_factory=lambda: _NONE)  # places that the point P shall pass; none of a function
    directions: Complexes = field(default_factory=lambda: _NONE)  # unit vectors along the body there, if there is one
    error_factor: float = 1.0  # the study's unit of errors: 1 of lengths, radians in its unit of angle
    apart: ClassVar[tuple[str, ...]] = ()  #: places that are no dimensions of the linkage

    @property
    def closed(self) -> bool:
        """Whether its positions end where they begin."""
        return self.section.path is not None and self.section.path.closed

    @property
    def free(self) -> bool:
        """Whether its positions are passed at whatever time."""
        return self.section.path is not None and self.section.path.timing is None

    def gaps(self, part: Candidates) -> list[Floats]:
        """Distance of the point P from its place at each position, of each assembly; shape (count, positions)."""
        return [np.abs(part.kind.points(part.kind.solve(part.values, part.angles, modes)) - self.points)
                for modes in part.kind.modes]  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class BodyGuidance(_Task):
    """Positions of a body."""

    positions: Positions
    apart: ClassVar[tuple[str, ...]] = (f"{BODY}.{POINT}.x", f"{BODY}.{POINT}.y")

    def pools(self, random: np.random.Generator, conditions: Conditions) -> Iterator[Linkages]:
        """Linkages of every kind and assembly."""
        section, sites = self.section, conditions.sites
        conditions.told += filter(None, [self.positions.remark])
        if self.positions.straight:
            return
        found, spare = body.choices(self.positions, *sites, random, within_reach=True)
        given = any(map(any, (site.fixed for site in sites)))
        what, real = f"{len(self.positions.places)} positions", f"{sum(map(len, found))} real dyads"
        words = body.told(f"{what} and what is given" if given else what, spare, real,
                          "that keep what is given" if given else "of at most 4")  # fmt: skip
        placed = [conditions.placed(part) for part in found]
        most = section.evaluations or PAIRS
        parts = [*body.pairs(self.positions, placed, sites, section.lengths, section, random, most)]
        drawn = f", of which {most} of each kind are drawn" * any(len(part.values) >= most for part, _ in parts)
        conditions.told.append(f"{words}, {counted(sum(pairs for _, pairs in parts), 'pair')}{drawn}")
        if not parts:
            # The nearest is one of the others.
            frame, pins = (Site(site.centre, site.size, site.reach) for site in sites)
            for wished in (section, section.model_copy(update={"kinds": (), "slide": False})):
                parts = parts or [*body.pairs(self.positions, found, (frame, pins), {}, wished, random, most)]
        for part, _ in parts:
            yield from assembled(part, self.gaps(part), conditions, self.size)

    def targets(self, solution: Solution) -> tuple[str, dict[str, Any]]:
        """The output that is judged, and what the outputs should be at each position, in the study's units."""
        turns = np.unwrap(np.angle(self.positions.rotations)) / self.factor
        return POINT, {POINT: self.positions.places.tolist(), f"{BODY}.angle": turns.tolist()}


@dataclass(frozen=True, eq=False, kw_only=True)
class FunctionGeneration(_Task):
    """Pairs of an input angle and an output angle or place."""

    inputs: Floats  # radians
    outputs: Floats  # radians, or lengths

    @property
    def slides(self) -> bool:
        """Whether the output is a slide."""
        return self.section.output_kind != FOUR_BAR

    def pools(self, random: np.random.Generator, conditions: Conditions) -> Iterator[Linkages]:
        """Linkages of every assembly."""
        # The output link, or the slider, as it is seen from the input link.
        back = np.exp(-1j * self.inputs)
        place = self.outputs if self.slides else np.full(len(back), self.size)
        seen = Positions(place * back, back if self.slides else back * np.exp(1j * self.outputs))
        frame = output = Site(0j, self.size, self.section.bounds.reach)
        if self.section.zeros == "fixed":
            # Pins lie on the x axes of the links, that of a slider on its y axis.
            frame = replace(frame, ends=((-np.inf, np.inf), (0.0, 0.0)))
            output = replace(frame, axis=1j) if self.slides else frame
        found, spare = body.choices(seen, frame, output, random)
        links = self._couplers(found)
        # Of the four dyads of five pairs the frame is one; with fixed zeros three pairs have one coupler.
        fixed, what = any(frame.fixed), f"{len(self.inputs)} pairs"
        words = body.told(f"{what} with fixed zeros" if fixed else what, spare,
                          counted(len(links), "real linkage"), f"of at most {1 if fixed else 3}")  # fmt: skip
        conditions.told.append(words)
        pools = self._assembled(links, conditions)
        if not pools:
            # Of many pairs the frame may be the only best coupler: the nearest pass some pairs.
            links = self._couplers(body.choices(seen, frame, output, random, refined=False)[0])
            pools = self._assembled(links, conditions)
        yield from pools

    def _away(self, poses: Configuration) -> Floats:
        """By how much the output is beyond what it should be, shape (count, positions): its zero, and errors."""
        if self.slides:
            return np.asarray(poses.point("B").real - self.outputs)
        return np.unwrap(np.angle(poses.rotation("rocker") * np.exp(-1j * self.outputs)))

    def _zero(self, solution: Solution) -> float:
        """From where the outputs of a linkage count."""
        away = self._away(solution.poses)[0][solution.poses.valid[0]]
        if self.section.zeros == "fixed":
            return 0.0 if self.slides else float(np.pi * np.round(away.mean() / np.pi))
        return float(away[0] if len(solution.elsewhere) else away.mean())

    def targets(self, solution: Solution) -> tuple[str, dict[str, Any]]:
        """The output that is judged, and what it should be at each position, in the study's units."""
        output = "B.x" if self.slides else "rocker.angle"
        return output, {output: ((self.outputs + self._zero(solution)) / self.error_factor).tolist()}

    def _assembled(self, links: Dyads, conditions: Conditions) -> list[Linkages]:
        """The linkages with these couplers."""
        if not len(links):
            return []
        part = self._linkage(links)
        pools = assembled(part, self.errors(part, links), conditions, self.size if self.slides else 1.0)
        return [*pools] if self.section.zeros == "fixed" else [*map(self._from_best_zero, pools)]

    def _from_best_zero(self, pool: Linkages) -> Linkages:
        """The linkages with the errors from the zero that is best for all pairs, where one assembly passes them."""
        way = pool.way
        away = self._away(way.kind.solve(way.values, way.angles, way.modes))
        best = np.abs(away - away.mean(axis=1, keepdims=True))
        lost = (way.elsewhere | ~np.isfinite(pool.errors)).any(axis=1, keepdims=True)
        return replace(pool, errors=np.where(lost, pool.errors, best))

    def _couplers(self, parts: Sequence[Dyads]) -> Dyads:
        """The links among dyads between the input and the output but the frame itself."""
        links = next(part for part in parts if part.kind == LINK)
        return links.take(
            (np.abs(links.pivot) > EXACT * self.size) & (self.slides | (np.abs(links.pin) > EXACT * self.size))
        )

    def _linkage(self, links: Dyads) -> Candidates:
        """The linkages with these couplers; the crank stands at the input plus the angle of its pin."""
        kind = kind_of("function", self.section.output_kind)
        values = np.tile(kind.nominal, (len(links), 1))
        numbers: dict[str, Any] = {
            "ground.O.x": 0.0,
            "ground.O.y": 0.0,
            "crank.length": np.abs(links.pivot),
            "coupler.length": links.length,
        }
        if self.slides:
            numbers |= {"ground.D.x": 0.0, "ground.D.y": links.pin.imag, "rail.direction": 0.0}
        else:
            numbers |= {"ground.D.x": self.size, "ground.D.y": 0.0, "rocker.length": np.abs(links.pin)}
        for name, number in numbers.items():
            values[:, kind[name]] = number
        return Candidates(kind, values, self.inputs + np.angle(links.pivot)[:, None])

    def errors(self, part: Candidates, links: Dyads) -> list[Floats]:
        """Errors of the output at each input, of each assembly."""
        gaps = []
        for modes in part.kind.modes:
            poses = part.kind.solve(part.values, part.angles, modes)
            if self.slides:
                gaps.append(np.abs(part.kind.points(poses).real - self.outputs - links.pin.real[:, None]))
                continue
            turned = np.where(poses.valid, poses.rotation("rocker"), np.nan)
            gaps.append(np.abs(np.angle(turned * np.exp(-1j * (self.outputs + np.angle(links.pin)[:, None])))))
        return gaps


@dataclass(frozen=True, eq=False, kw_only=True)
class PathGeneration(_Task):
    """Points that a point passes."""

    path: paths.PathPoints
    given: int  # points that the task has, of which the path may have every second, third and so on
    kinds: Sequence[Kind]

    def targets(self, solution: Solution) -> tuple[str, dict[str, Any]]:
        """The output that is judged, and where it should be at each position."""
        return solution.kind.point, {solution.kind.point: self.points.tolist()}

    def pools(self, random: np.random.Generator, conditions: Conditions) -> Iterator[Linkages]:
        """Linkages of every kind and assembly."""
        if len(self.points) < self.given:
            conditions.told.append(f"{len(self.points)} of {self.given} points count, evenly chosen")
        site, pools = conditions.sites[0], list[Linkages]()
        # Where no sample is within all conditions the nearest is one of the others.
        wide = self.section.model_copy(update={"lengths": {}, "pivots": None, "transmission": None})
        others = replace(self, section=wide), Site(site.centre, site.size, site.reach), list[str]()
        for task, room, told in ((self, site, conditions.told), others):
            if not pools:
                conditions.progress.start(sum(len(kind.begun) for kind in self.kinds), "assemblies searched")
            for kind in self.kinds if not pools else ():
                pools += task.of_kind(kind, task.bound(kind, room), random, conditions, told)
        yield from pools

    def of_kind(
        self, kind: Kind, bound: Bounds, random: np.random.Generator, conditions: Conditions, told: list[str]
    ) -> Iterator[Linkages]:
        """Linkages of every assembly of a kind; what is found is `told` in words."""
        starts = [self._starts(kind, modes, bound, random) for modes in kind.begun]
        # They are counted in turn.
        turns = [part.numbers * len(starts) + k for k, part in enumerate(starts)]
        every = np.sort(np.concatenate(turns))
        starts = [replace(part, numbers=np.searchsorted(every, turn))
                  for part, turn in zip(starts, turns, strict=True)]  # fmt: skip
        points, count, exact = len(self.points), len(every), list[paths.Starts]()
        few = points <= paths.MOST_EXACT
        # Where the points leave no choice, linkages that pass them may need an assembly at each.
        alone = few and len(kind.modes) > 1 and (points if self.free else 2 * points - 1) >= bound.freedom
        if alone and count:
            exact.append(_distinct([passing(kind, self.path, starts, bound)], self.size))
            part = Candidates(kind, exact[0].values, exact[0].angles)
            if len(part.values):
                yield from assembled(part, self.gaps(part), conditions, self.size)
        for modes, start in zip(kind.begun, starts, strict=True):
            fits = paths.fits(kind, modes, self.path, start, bound, whole=few and not alone)
            passes = fits.costs <= (EXACT * self.size) ** 2 * points
            exact.append(paths.Starts(fits.values[passes], fits.angles[passes], fits.numbers[passes]))
            conditions.progress.update(1)
            if not len(fits.costs):
                continue
            rows = conditions.begun(kind, fits.values, np.argsort(fits.costs, kind="stable"), MOST)
            values, angles = fits.values[rows], fits.angles[rows]
            gaps = np.abs(kind.points(kind.solve(values, angles, modes)) - self.points)
            none = np.zeros(gaps.shape, dtype=bool)
            yield Linkages(passed(kind, modes, values, angles, none, full_turn=self.section.needs_turn), gaps)
        if not count:
            told.append(f"{in_words(kind.name)}: no sample has a curve within all conditions")
        elif few:
            numbers = _distinct(exact, self.size).numbers
            words = f"{len(numbers)} exact, the last new one at start {numbers[-1] + 1} of {count}" \
                if len(numbers) else f"none exact of {count} starts"  # fmt: skip
            told.append(f"{in_words(kind.name)}: {words}")

    def bound(self, kind: Kind, site: Site) -> Bounds:
        """What keeps linkages of a kind within the limits."""
        section = self.section
        if isinstance(kind, OwnKind):
            return RangeBounds(kind, turning=section.needs_turn, least=section.least_sine(self.factor))
        return KindBounds(kind, section, site, self.factor)

    def _starts(self, kind: Kind, modes: tuple[int, ...], bound: Bounds, random: np.random.Generator) -> paths.Starts:
        """Linkages of a kind in an assembly from which exact ones and near ones are looked for."""
        section = self.section
        ratio = min(section.bounds.ratio, _SAMPLED) if bound.in_place else section.bounds.ratio
        count = section.evaluations or (PATHS if self.path.closed else OPEN_PATHS)
        samples = kind.samples(random, count, ratio, full_turn=section.needs_turn)
        if bound.in_place:
            samples = bound.placed(samples)
        most = max(_FEWEST, paths.POLISHED * _MANY // max(_MANY, len(self.points)))
        return paths.starts(kind, modes, self.path, samples, bound, most)


Task = BodyGuidance | FunctionGeneration | PathGeneration


def _distinct(parts: Sequence[paths.Starts], size: float) -> paths.Starts:
    """Exact linkages, each once, by the first start that led to it."""
    values, angles, numbers = (np.concatenate([getattr(part, name) for part in parts])
                               for name in ("values", "angles", "numbers"))  # fmt: skip
    kept = list[int]()
    for row in np.argsort(numbers, kind="stable").tolist():
        gaps = np.abs(values[kept] - values[row]) / (np.abs(values[row]) + size)
        if gaps.max(axis=1, initial=0.0).min(initial=np.inf) > _DISTINCT:
            kept.append(row)
    return paths.Starts(values[kept], angles[kept], numbers[kept])


def assembled(part: Candidates, gaps: Sequence[Floats], conditions: Conditions, size: float) -> Iterator[Linkages]:
    """Linkages, each in an assembly whose largest error is no larger than with an assembly at each position.

    Where there is none it is the one that is nearest at the first position; those that it misses by more need another.
    Errors are infinite at positions at which they cannot be assembled.
    """
    stack = np.nan_to_num(np.stack(gaps), nan=np.inf)
    nearest = stack.min(axis=0)
    errors, unreached = nearest.max(axis=1), np.isinf(nearest)
    lost = unreached.sum(axis=1)
    most = np.where(unreached, 0.0, nearest).max(axis=1, keepdims=True)
    passes = unreached | (stack <= most + _EQUAL * size)
    whole = passes.all(axis=2)
    # Those without a defect come first, as far as the positions alone tell.
    order = np.lexsort(
        (np.where(errors < EXACT * size, 0.0, errors), in_order(part.angles)[1], ~whole.any(axis=0), lost)
    )
    rows = conditions.begun(part.kind, part.values, order, MOST)
    kept = conditions.counted([("it cannot be assembled at a position", lost[rows] == 0)], len(rows))
    # Where none can be, that with the fewest such positions is the nearest.
    rows = rows[kept] if kept.any() else rows[:1][lost[rows[:1]] < stack.shape[2]]
    known = (~unreached[rows]).argmax(axis=1)
    begun = stack[:, rows, known] <= nearest[rows, known] + _EQUAL * size
    first = (2 * whole[:, rows] + begun).argmax(axis=0)
    for number, modes in enumerate(part.kind.modes):
        some = rows[first == number]
        if len(some):
            other = ~passes[number, some]
            way = passed(part.kind, modes, part.values[some], part.angles[some], other,
                         full_turn=conditions.section.needs_turn)  # fmt: skip
            yield Linkages(way, np.where(other, nearest[some], stack[number, some]))


def task_of(study: Study, section: SynthesisSection) -> Task:
    """The task of a study."""
    factor = study.units.angle_factor
    if section.body is not None:
        places = np.array([complex(part.x, part.y) for part in section.body])
        positions = Positions(places, np.exp(1j * factor * np.array([part.angle for part in section.body])))
        return BodyGuidance(section=section, factor=factor, centre=positions.centre, size=positions.size, points=places,
                            directions=positions.rotations, positions=positions)  # fmt: skip
    if section.function is not None:
        inputs, outputs = factor * np.array(section.function.input), np.array(section.function.output, dtype=float)
        size, unit = float(np.ptp(outputs)), 1.0
        centre = complex(outputs.mean())
        if section.output_kind == FOUR_BAR:
            size, unit, outputs = float(section.frame or 1.0), factor, factor * outputs
            centre = complex(size / 2)
        return FunctionGeneration(section=section, factor=factor, centre=centre, size=size, error_factor=unit,
                                  inputs=inputs, outputs=outputs)  # fmt: skip
    assert section.path is not None
    points = section.path.points
    try:
        table = read_table(study.folder, points) if isinstance(points, str) else np.array(points, dtype=float)
    except StudyError as error:
        raise StudyError([study.problem(str(error), "synthesis", "path", "points")]) from None
    if table.shape[1] != 2 or len(table) < 2:
        raise StudyError(
            [study.problem("a path has two points or more, a row [x, y] each", "synthesis", "path", "points")]
        )
    timing = None if section.path.timing is None else factor * np.array(section.path.timing)
    if timing is not None and len(timing) != len(table):
        message = f"{len(timing)} crank angles for {len(table)} points"
        raise StudyError([study.problem(message, "synthesis", "path", "timing")])
    # The form of a path needs no more points; the time of a search grows with them.
    given, every = len(table), -(-len(table) // _MOST_POINTS)
    table, timing = table[::every], None if timing is None else timing[::every]
    path = paths.PathPoints(table[:, 0] + 1j * table[:, 1], section.path.closed, timing)
    if not path.size > 0:
        raise StudyError([study.problem("all points of the path are one", "synthesis", "path", "points")])
    kinds = (
        [own_kind(study, section)] if section.of else [kind_of("path", name) for name in section.kinds or (FOUR_BAR,)]
    )
    return PathGeneration(section=section, factor=factor, centre=path.centre, size=path.size, points=path.points,
                          path=path, given=given, kinds=kinds)  # fmt: skip

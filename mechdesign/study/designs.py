"""Designs of a study, one or thousands at once, that differ in parameters or single places of the geometry."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.commands import COMMANDS
from mechdesign.ground.errors import Problem, StudyError
from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism.mechanism import Variant
from mechdesign.motion.rows import DesignNumbers
from mechdesign.study.loaded import Study
from mechdesign.study.loading import load_document
from mechdesign.study.schema.targets import Target
from mechdesign.study.text.document import Document
from mechdesign.study.text.fields import Model, own_numbers, parts_of, positive
from mechdesign.study.text.reading import MIN_NUMBER
from mechdesign.study.text.units import Amount
from mechdesign.study.variants import Judging, changed_data, remeasured


@dataclass(frozen=True, eq=False)
class Designs:
    """Designs of a study by the values of what changes, each of shape (count,), in the study's units."""

    study: Study
    changed: Mapping[str, Floats]

    @cached_property
    def count(self) -> int:
        """Number of designs."""
        return len(next(iter(self.changed.values()), (0,)))

    @cached_property
    def parameters(self) -> dict[str, Floats]:
        """Parameters that differ from the study's own design, shape (count,)."""
        values = self.study.parameters.values(self.changed)
        moved = self.study.parameters.moved(self.changed)
        return {name: self._by_design(value) for name, value in values.items() if name in moved}

    @cached_property
    def places(self) -> dict[str, Floats]:
        """Places of the geometry that do, in lengths and radians, shape (count,)."""
        return {name: self._by_design(value) for name, value in self.study.parameters.places(self.changed).items()}

    @cached_property
    def numbers(self) -> DesignNumbers:
        """What a study's poses are made of."""
        nominal = self.study.parameters.nominal
        return DesignNumbers(self.count, self.parameters, self.places, nominal, frozenset(self.changed))

    def one(self, k: int) -> Study:
        """The study of one design, as if its file had these numbers; the assembly stays the sketch's.

        A place that is changed itself becomes a number: parameters no longer change it.

        Raises
        ------
        StudyError
            If its numbers make no study.
        MechanismError, AssemblyError
            See `mechdesign.mechanism.mechanism.Variant`.
        """
        study, old = self.study, self.study.parameters
        if not self.changed:
            return study
        changed = {name: float(values[k]) for name, values in self.changed.items()}
        if self.faults[k]:
            raise StudyError([Problem(self.faults[k], "mechanism", str(study.path or ""))])
        resolved = changed_data(study, changed)
        if not self.alike:
            document = Document.of(resolved, str(study.path or ""))
            return load_document(document, study.source, study.overrides, study.seed, study.mechanism)
        parameters = {name: float(value) for name, value in old.values(changed).items()}
        places = {name: float(values[k]) for name, values in self.places.items()}
        description = study.mechanism.description
        new = {name: replace(description.places[name], nominal=value) for name, value in places.items()}

        def number(amount: Amount) -> Amount:
            assert amount.expression is not None
            return Amount(float(amount.expression.evaluate(parameters)), amount.text, amount.expression)

        sections: dict[str, Any] = {
            command.key: section.with_numbers(number)
            for command in COMMANDS.values() if isinstance(section := study.sections.get(command.key), Model)
        }  # fmt: skip
        return replace(
            study.with_sections(**sections),
            requirements=tuple(requirement.with_numbers(number) for requirement in study.requirements),
            targets={owner: _retabled(target, number) for owner, target in study.targets.items()},
            curves={owner: _retabled(target, number) for owner, target in study.curves.items()},
            resolved=resolved,
            mechanism=Variant(study.mechanism, replace(description, places={**description.places, **new})),
            parameters=replace(
                old,
                nominal=parameters,
                formulas={name: formula for name, formula in old.formulas.items() if name not in changed},
                dependent={place: formula for place, formula in old.dependent.items() if place not in changed},
                measured=old.measured.difference(changed),
            ),
        )

    @cached_property
    def alike(self) -> bool:
        """Whether designs differ in numbers alone: not in whole numbers, nor in what is measured from the sketch."""
        moved = self.study.parameters.moved(self.changed)
        return moved.isdisjoint(self.study.fixed) and not remeasured(self.study, self.changed)

    def required(self, judging: Sequence[Judging]) -> Iterator[Judging]:
        """What is required of each design, with its own numbers where these follow parameters."""
        followers: dict[int, list[int]] = {}
        for k, own in enumerate(judging):
            required = [*own.requirements]

            def number(amount: Amount, k: int = k) -> Amount:
                if not self.numbers.moves(amount):
                    return amount
                value = float(self.numbers.of(amount)[k])
                return Amount(value, self.study.units.as_written(value, amount.text), amount.expression)

            if id(own) not in followers:
                followers[id(own)] = [j for j, one in enumerate(required) if one.with_numbers(Amount) is not one]
            for j in followers[id(own)]:
                required[j] = required[j].with_numbers(number)
            yield own._replace(requirements=tuple(required))

    def take(self, rows: Ints) -> Designs:
        """Some of the designs; a study without changes stays the one that it is."""
        return Designs(self.study, {name: values[rows] for name, values in self.changed.items()})

    @cached_property
    def faults(self) -> NDArray[np.object_]:
        """Why the numbers of each design make no study, shape (count,); empty where they do."""
        reasons = np.full(self.count, "", dtype=object)

        def note(wrong: Any, message: str | Callable[[int], str]) -> None:
            for k in np.flatnonzero(np.broadcast_to(wrong, self.count) & (reasons == "")).tolist():
                reasons[k] = message if isinstance(message, str) else message(k)

        self._judge_geometry(note)
        for command in COMMANDS:
            section = self.study.sections.get(command)
            if isinstance(section, Model):
                self._judge(section, command, note)
        return reasons

    def _by_design(self, value: Number) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), self.count)

    def _judge_geometry(self, note: Any) -> None:
        """Note designs whose geometry makes no mechanism; `note` takes a mask of designs and a message."""
        places, nominal = self.places, self.study.mechanism.nominal
        for name, value in (*self.parameters.items(), *places.items()):
            note(~np.isfinite(value), f"{name} has no finite value")
        for name, value in places.items():
            place = self.study.mechanism.description.places[name]
            if place.least is not None:
                wrong = value <= place.least if place.exclusive else value < place.least
                note(wrong, f"{name} is {'not positive' if place.exclusive else 'negative'}")
        for a, b, gap in self.study.mechanism.contradictions(places):
            note(gap > 0, f"the angles of the slides and clamps between '{a}' and '{b}' contradict each other")
        for index, limit in enumerate(self.study.mechanism.description.limits):
            ends = [f"limits.{index}.{end}" for end in ("min", "max")]
            low, high = (places.get(end, nominal.get(end)) for end in ends)
            if low is not None and high is not None:
                note(np.asarray(high) < low, f"limits.{index}: the maximum is below the minimum")
            for end in (low, high):
                if limit.kind == "distance" and end is not None:
                    note(np.asarray(end) < 0, f"limits.{index}: a distance is never negative")

    def _judge(self, section: Model, name: str, note: Any) -> None:
        """Note designs with numbers that a section of the study does not allow."""
        for key, part in parts_of(section, name):
            moved = [number for number in own_numbers(part) if self.numbers.moves(number)]
            if isinstance(part, Amount) and moved:
                column = self.numbers.of(part)
                note(~np.isfinite(column), f"{key} has no finite value")
                if part.least is not None:
                    small = column <= part.least if part.exclusive else column < part.least
                    note(small, f"{key} must be {positive(part.least, exclusive=part.exclusive)}")
                    note((column > 0) & (column < MIN_NUMBER), f"{key} is too small a number")
            elif isinstance(part, Model) and moved:
                for misfit in part.with_numbers(self._numbers_of).misfits():
                    note(misfit.wrong, lambda k, key=key, misfit=misfit: f"{key}: {misfit.message(k)}")

    def _numbers_of(self, number: Amount) -> float | Floats:
        """A number of all designs, or of each where they differ in it."""
        return self.numbers.of(number) if self.numbers.moves(number) else number


def variant(study: Study, changed: Mapping[str, float]) -> Study:
    """The study with other values of parameters or single places, in its units; see `Designs.one`.

    Raises
    ------
    StudyError
        If a name is neither a parameter nor a place, or the values make no study.
    """
    names = study.parameters.names()
    unknown = [name for name in changed if name not in names]
    if unknown:
        file = str(study.path or "")
        raise StudyError([Problem("is neither a parameter nor a dimension", name, file) for name in unknown])
    return Designs(study, {name: np.array([value], dtype=float) for name, value in changed.items()}).one(0)


def _retabled(target: Target, number: Callable[[Amount], Amount]) -> Target:
    """A target whose table has other numbers where they follow parameters."""
    if not target.rows:
        return target
    rows = [[number(cell) if isinstance(cell, Amount) and cell.expression else cell for cell in row]
            for row in target.rows]  # fmt: skip
    return replace(target, rows=rows, table=np.array(rows, dtype=float))

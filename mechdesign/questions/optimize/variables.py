"""Design variables, whose bounds may depend on each other: their grid, their map to the unit cube, and their studies.

A design is a number for each variable; for a variable whose choices are words it is the number of the choice.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.errors import Problem, StudyError
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.schema.variable import Variable, plainly
from mechdesign.study.variants import entry_unit, faults, with_entries

# Fraction of a step by which the last step may end beyond the bound, as in sweeps.
BOUND_ROUNDING = 1e-9
MAX_DESIGNS = 50_000_000

# Designs by the values of their variables, each of shape (designs,).
Batch = Mapping[str, Floats]
# One design by its variables: numbers, and the words of choices that are none.
Design = Mapping[str, float | str]


def variables_of(study: Study) -> Mapping[str, Variable]:
    """The design variables of a study."""
    assert study.optimize is not None
    return study.optimize.variables


def ranges(study: Study) -> list[str]:
    """Variables that have a range rather than choices."""
    return [name for name, variable in variables_of(study).items() if variable.choices is None]


def bounds(study: Study, designs: Batch, name: str, count: int) -> tuple[Floats, Floats]:
    """Bounds of a range, which may follow the variables above it in `designs`; each of shape (count,).

    For a whole number they are the first and the last whole number within the given bounds.
    """
    variable = variables_of(study)[name]
    assert variable.from_ is not None
    assert variable.to is not None
    parameters = {key: value for key, value in designs.items() if key in study.parameters.nominal}
    env = {**study.parameters.values(parameters), **designs}
    low, high = (np.asarray(bound.evaluate(env), dtype=float) for bound in (variable.from_, variable.to))
    if variable.integer:
        slack = BOUND_ROUNDING * np.maximum(1.0, np.maximum(np.abs(low), np.abs(high)))
        low, high = np.ceil(low - slack), np.floor(high + slack)
    return np.broadcast_to(low, count), np.broadcast_to(high, count)


def _spaced(study: Study, designs: Batch, name: str, count: int) -> tuple[Floats, Floats, Floats]:
    """First value, step and number of values of a variable that has steps, each of shape (count,).

    For choices they are the numbers of the choices. The number of values is 0 where none lies between the bounds.
    """
    variable = variables_of(study)[name]
    if variable.choices is not None:
        return np.zeros(count), np.ones(count), np.full(count, float(len(variable.choices)))
    low, high = bounds(study, designs, name, count)
    if variable.step is not None or variable.integer:
        step = np.full(count, float(variable.step or 1))
        counts = np.floor((high - low) / step + BOUND_ROUNDING) + 1
    else:
        counts = np.where(high >= low, float(variable.number or 1), 0.0)
        step = (high - low) / np.maximum(counts - 1, 1)
    return low, step, np.where(np.isfinite(counts), np.maximum(counts, 0), 0)


def _valued(variable: Variable, numbers: Floats) -> Floats:
    """Values of a variable from the numbers of `_spaced`."""
    if variable.choices is None or not variable.numeric:
        return numbers
    return np.array(variable.choices, dtype=float)[numbers.astype(np.intp)]


class CubeDesigns(NamedTuple):
    """Designs at points of the unit cube.

    Parameters
    ----------
    designs : dict of str to ndarray
        Value of each variable.
    given : ndarray of bool, shape (designs,)
        Which designs have a value for every variable.
    u : ndarray, shape (designs, variables)
        The points, moved to the middle of the shares of whole numbers and choices: two points of one design are equal.
    """

    designs: dict[str, Floats]
    given: Flags
    u: Floats


def from_cube(study: Study, u: Floats) -> CubeDesigns:
    """Designs at points of the unit cube, shape (designs, variables).

    A point has fractions of the way from each lower bound to the upper one; whole numbers and choices have equal shares
    of that way.
    """
    designs: dict[str, Floats] = {}
    given, middle = np.ones(len(u), dtype=bool), u.copy()
    for k, (name, variable) in enumerate(variables_of(study).items()):
        share = u[:, k]
        if variable.stepped:
            low, step, counts = _spaced(study, designs, name, len(u))
            well = counts > 0
            index = np.clip(np.floor(share * counts), 0, np.maximum(counts - 1, 0))
            middle[well, k] = (index[well] + 0.5) / counts[well]
            designs[name] = _valued(variable, np.where(well, low + index * step, 0.0))
        else:
            low, high = bounds(study, designs, name, len(u))
            well = np.isfinite(low) & np.isfinite(high) & (high >= low)
            low, high = np.where(well, low, 0.0), np.where(well, high, 0.0)
            # At the upper bound exactly, without rounding error.
            designs[name] = np.where(share == 1, high, low + share * (high - low))
        given &= well
    return CubeDesigns(designs, given, middle)


def grid(study: Study) -> dict[str, Floats]:
    """Values of each variable for every design, the last variable varying fastest.

    Raises
    ------
    StudyError
        If the grid is empty, or larger than any computer would finish.
    """
    columns: dict[str, Floats] = {}
    for name, variable in variables_of(study).items():
        low, step, counts = _spaced(study, columns, name, len(next(iter(columns.values()), [0])))
        total = int(counts.sum())
        if not 0 < total <= MAX_DESIGNS:
            message = "no value lies between 'from' and 'to' for any design"
            if total:
                message = f"the grid has {total} designs; {MAX_DESIGNS} is the limit: take larger steps"
            raise StudyError((study.problem(message, "optimize", "variables", name),))
        repeats = counts.astype(int)
        index = np.arange(total) - np.repeat(np.cumsum(repeats) - repeats, repeats)
        columns = {key: np.repeat(values, repeats) for key, values in columns.items()}
        columns[name] = _valued(variable, np.repeat(low, repeats) + index * np.repeat(step, repeats))
    return columns


def steps(study: Study, at: Batch) -> dict[str, Floats]:
    """The step of each range at some designs: of the grid or of whole numbers, else a hundredth of the range."""
    widths = {}
    for name in ranges(study):
        variable = variables_of(study)[name]
        low, high = bounds(study, at, name, len(at[name]))
        intervals = 100 if variable.number is None else max(variable.number - 1, 1)
        fixed = variable.step or float(variable.integer)
        widths[name] = np.full(len(low), fixed) if fixed else (high - low) / intervals
    return widths


def shown(study: Study, name: str, values: Floats) -> NDArray[Any]:
    """Values of a variable as tables have them: numbers, or the words of its choices."""
    words = variables_of(study)[name].words
    return np.array(words)[values.astype(np.intp)] if words else values


def entries(study: Study, designs: Batch) -> dict[str, NDArray[Any]]:
    """Designs as a `Family` takes them: with choices and whole numbers as the study has them."""

    def own(name: str, values: Floats) -> NDArray[Any]:
        variable = variables_of(study)[name]
        if name in study.parameters.names() or (variable.numeric and not variable.integer):
            return values
        if variable.integer:
            return values.astype(np.intp)
        choices = np.empty(len(variable.words), dtype=object)
        choices[:] = variable.choices
        return choices[values.astype(np.intp)]

    return {name: own(name, values) for name, values in designs.items()}


def unit_of(study: Study, name: str) -> str:
    """Unit of a variable, where it is known; none of words."""
    if name in study.parameters.names():
        return study.unit_of(name) or ""
    return entry_unit(study, name) if variables_of(study)[name].numeric else ""


def entry_of(study: Study, name: str, value: float | str) -> tuple[str, Any]:
    """The entry that a variable changes, by the name that ``--set`` takes, and its value there.

    `value` is a number, or the word of a choice.
    """
    variable = variables_of(study)[name]
    own = f"mechanism.parameters.{name}" if name in study.parameters.nominal else name
    if isinstance(value, str):
        assert variable.choices is not None
        return own, variable.choices[variable.words.index(value)]
    return own, plainly(value)


def parted(study: Study, design: Design) -> tuple[Study, dict[str, float]]:
    """The study with the entries of a design, and the parameters and dimensions in which the design differs from it.

    Raises
    ------
    StudyError
        If the entries make no study.
    """
    parameters = study.parameters.names()
    changes = [entry_of(study, name, value) for name, value in design.items() if name not in parameters]
    numbers = {name: float(value) for name, value in design.items() if name in parameters}
    return with_entries(study, changes) if changes else study, numbers


def study_of(study: Study, design: Design) -> Study:
    """The study of a design; raises as `mechdesign.study.designs.Designs.one`."""
    return variant(*parted(study, design))


def choice_problems(study: Study) -> Iterator[Problem]:
    """Problems of the choices of entries: the study is loaded with each choice alone.

    A mistake that needs several choices makes a design infeasible.
    """
    for name, variable in variables_of(study).items():
        if variable.choices is not None and name not in study.parameters.names():
            # Choices are tried as they are written: the units must fit the entry.
            choices = study.resolved["optimize"]["variables"][name]["choices"]
            for k, own in enumerate(choices):
                for message in faults(study, [(name, own)], name):
                    yield study.problem(message, "optimize", "variables", name, "choices", k)


def in_words(row: Design) -> str:
    """``l_min = 1.15, section = tube``."""
    return ", ".join(f"{name} = {value if isinstance(value, str) else f'{value:g}'}" for name, value in row.items())

"""Checks that the entries changed by cases and designs exist, and that none is named twice."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from mechdesign.commands import COMMANDS
from mechdesign.ground.errors import StudyError, suggestion
from mechdesign.study.building.builder import place_name
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.study_file import entry, kinds_of
from mechdesign.study.schema.variable import Variable
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import shown

if TYPE_CHECKING:
    from mechdesign.experiments.schema.matrix import MatrixSection
    from mechdesign.questions.optimize.schema import OptimizeSection

# Sections whose entries may be design variables.
_DESIGNED = ("mechanism", *(command for command in COMMANDS if command != "optimize"))


def number_at(keys: KeyPath, parameters: Collection[str], places: Collection[str]) -> str:
    """Name of the parameter or the place of the geometry at a path of a study; empty if there is none."""
    section, *path = keys
    if section != "mechanism" or len(path) < 2:
        return ""
    name, among = (str(path[1]), parameters) if path[0] == "parameters" else (place_name(tuple(path)), places)
    return name if name in among else ""


class _Varied:
    """Entries named so far."""

    def __init__(self, checker: Checker) -> None:
        self._checker = checker
        self._names: dict[KeyPath, str] = {}

    def add(self, path: KeyPath, name: str, place: KeyPath) -> None:
        """Add an entry; report it at `place` if it equals, contains or lies inside an earlier one."""
        for keys, other in self._names.items():
            if path[: len(keys)] == keys[: len(path)]:
                message = f"{name} and {other} are, or hold, the same entry; vary one of them"
                self._checker.report(place, message, at_key=True)
        self._names[path] = name


def check_varied(matrix: MatrixSection, checker: Checker) -> None:
    """Check that the entries that a matrix varies exist, and that none equals or contains another."""
    at: KeyPath = ("matrix", "vary") if matrix.vary is not None else ("matrix", "cases")
    try:
        names = tuple(matrix.vary) if matrix.vary is not None else matrix.table(checker.folder).names
    except StudyError as error:
        checker.report(at, str(error))
        return
    varied = _Varied(checker)
    for name in names:
        place = (*at, name) if matrix.vary is not None else at
        try:
            path = entry(checker.reporter.document.data, name)
        except StudyError as error:
            checker.report(place, str(error) if matrix.vary is not None else f"column {name!r}: {error}", at_key=True)
            continue
        if path[0] == "matrix":
            checker.report(place, "a matrix does not vary itself", at_key=True)
        if path[0] == "units":
            checker.report(place, "cases are compared in the units of the study, which no case changes", at_key=True)
        varied.add(path, name, place)


def check_variables(section: OptimizeSection, checker: Checker) -> OptimizeSection:
    """Check names, bounds, choices and units of the design variables.

    Returns the section, in which what is a parameter or a dimension has the name of that.
    """
    parameters, varied = checker.parameters, _Varied(checker)
    variables: dict[str, Variable] = {}
    above = [name for name in parameters.nominal if name not in section.variables]
    for name, variable in section.variables.items():
        path: KeyPath = ("optimize", "variables", name)
        for key, bound in (("from", variable.from_), ("to", variable.to)):
            for unknown in sorted(bound.names - {*above} if bound is not None else ()):
                below = " above it" if unknown in section.variables else ""
                message = f"there is no parameter or variable {unknown!r}{below}{suggestion(unknown, above)}"
                checker.report((*path, key), message)
        if section.method == "grid" and not variable.stepped and variable.step is None and variable.number is None:
            checker.report(path, "a variable of a grid needs either 'step' or 'number'; 'method: search' needs neither")
        own, keys = _named(name, variable, checker)
        varied.add(keys, name, path)
        variables[own] = variable
        if own in parameters.names():
            above.append(own)
            _check_number(own, variable, path, checker)
        elif len(kinds := kinds_of(keys)) == 1:
            checker.kind(path, *kinds)
    return section.model_copy(update={"variables": variables})


def _named(name: str, variable: Variable, checker: Checker) -> tuple[str, KeyPath]:
    """The name of a design variable, that of its parameter or dimension if it is one, and a path that identifies it."""
    names, path = checker.parameters.names(), ("optimize", "variables", name)
    if name in names:
        return name, ("", name)
    if name.partition(".")[0] not in _DESIGNED:
        noun = "parameter or dimension" if "." not in name else "parameter, dimension or entry"
        checker.check_name(name, names, noun, path, at_key=True)
        return name, ("", name)
    try:
        keys = entry(checker.reporter.document.data, name)
    except StudyError as error:
        checker.report(path, str(error), at_key=True)
        return name, ("", name)
    if keys in (("mechanism",), ("mechanism", "parameters")):
        checker.report(path, f"{name} holds every parameter; name those that vary, one by one", at_key=True)
    own = number_at(keys, checker.parameters.nominal, checker.places) if variable.numeric else ""
    return (own, ("", own)) if own else (name, keys)


def _check_number(name: str, variable: Variable, path: KeyPath, checker: Checker) -> None:
    """Check a variable that is a parameter or a dimension."""
    if name in checker.parameters.formulas:
        message = f"parameter {name!r} follows from others by its expression; vary those, or give it a number"
        checker.report(path, message, at_key=True)
    for k, choice in enumerate(variable.choices or ()):
        if not isinstance(choice, int | float) or isinstance(choice, bool):
            checker.report((*path, "choices", k), f"{name} is a number, and {shown(choice)} is none")
    if (quantity := checker.quantity(name)) is not None:
        checker.kind(path, quantity)

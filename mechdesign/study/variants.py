"""A study with other dimensions: as if its file had been changed, without reading and checking it again.

Only numbers of the geometry are evaluated anew. Where other numbers of the study depend on what is changed (a sweep's
end, a tolerance, a dimension measured from the sketch) the data is validated again, so that they follow.
"""

from __future__ import annotations

import contextlib
import dataclasses
import pathlib
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from mechdesign.commands import COMMANDS
from mechdesign.errors import Problem, StudyError
from mechdesign.expressions import Expression, ExpressionError, Number
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Fixed
from mechdesign.mechanism.variant import Variant
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.building.section import LINK_KEYS
from mechdesign.study.loading import Study, load_document
from mechdesign.study.text.document import Document, Mark, leaves, plain

# Sections whose numbers are read once, when the study is loaded.
SECTIONS = (*(name for name in COMMANDS if name != "optimize"), "requirements")


def variant(study: Study, changed: Mapping[str, float]) -> Study:
    """The study with other values of parameters or single places, in its units; the assembly stays the sketch's.

    A parameter that depends on changed ones follows. A place that is changed itself becomes a number: parameters no
    longer change it.

    Raises
    ------
    StudyError
        If a name is neither a parameter nor a place, or the values make no mechanism.
    MechanismError, AssemblyError
        See `mechdesign.mechanism.variant.Variant`.
    """
    file, path = str(study.path or ""), study.path or pathlib.Path()
    check_names(study, changed)
    values = {name: np.asarray(value, dtype=float) for name, value in changed.items()}
    parameters, places = study.parameters.values(values), study.parameters.places(values)
    (wrong,) = faults(study, parameters, places, 1)
    if wrong:
        raise StudyError([Problem(wrong, "mechanism", file)])
    resolved = changed_data(study, changed)
    if follows(study, changed):
        document = Document(file, resolved, values={(): Mark(file)})
        return load_document(document, path, study.text_sha256, study.overrides, study.seed, study.mechanism)
    description = study.mechanism.description
    new = {name: dataclasses.replace(description.places[name], nominal=float(value)) for name, value in places.items()}
    description = dataclasses.replace(description, places={**description.places, **new})
    old = study.parameters
    return dataclasses.replace(
        study,
        resolved=resolved,
        mechanism=Variant(study.mechanism, description),
        parameters=Parameters(
            {name: float(value) for name, value in parameters.items()},
            {name: formula for name, formula in old.formulas.items() if name not in changed},
            {place: formula for place, formula in old.dependent.items() if place not in changed},
            old.factors,
            old.measured.difference(changed),
        ),
    )


def check_names(study: Study, names: Collection[str]) -> None:
    """Check that names are parameters or places.

    Raises
    ------
    StudyError
        With every name that is neither.
    """
    known = {*study.parameters.known()}
    wrong = [
        Problem("is neither a parameter nor a dimension", n, str(study.path or "")) for n in names if n not in known
    ]
    if wrong:
        raise StudyError(wrong)


def faults(study: Study, parameters: Mapping[str, Number], places: Mapping[str, Number], count: int) -> list[str]:
    """Why the numbers of each of `count` designs make no mechanism; empty where they do."""
    found = np.full(count, "", dtype=object)

    def note(wrong: Any, message: str) -> None:
        found[np.broadcast_to(wrong, count) & (found == "")] = message

    for name, value in (*parameters.items(), *places.items()):
        note(~np.isfinite(value), f"{name} has no finite value")
    nominal, links = study.mechanism.nominal, study.mechanism.description.links
    for name, value in places.items():
        owner, _, last = name.rpartition(".")
        if owner in links and last == "length":
            note(~(np.asarray(value) > 0), f"{name} is not positive")
    for index, limit in enumerate(study.mechanism.description.limits):
        low, high = (
            places.get(f"limits.{index}.{end}", nominal.get(f"limits.{index}.{end}")) for end in ("min", "max")
        )
        if low is not None and high is not None:
            note(np.asarray(high) < low, f"limits.{index}: the maximum is below the minimum")
        for end in (low, high):
            if limit.kind == "distance" and end is not None:
                note(np.asarray(end) < 0, f"limits.{index}: a distance is never negative")
    return [str(reason) for reason in found]


def moved(study: Study, names: Collection[str]) -> set[str]:
    """Those of the names that are parameters, and the parameters that follow from them."""
    found = {name for name in names if name in study.parameters.nominal}
    for name, formula in study.parameters.formulas.items():
        if name not in names and formula.names & found:
            found.add(name)
    return found


def places_of(study: Study, names: Collection[str]) -> set[str]:
    """Places that are among the names, or depend on one of them."""
    parameters = moved(study, names)
    followers = {place for place, formula in study.parameters.dependent.items() if formula.names & parameters}
    return {*followers, *(name for name in names if name in study.parameters.factors)}


def follows(study: Study, names: Collection[str], sections: Collection[str] = SECTIONS) -> bool:
    """Whether more than numbers of the geometry depends on parameters or places: numbers of sections, or the sketch's.

    A name in any text of a section counts: that it never misses matters more than that it is sometimes wrong.
    """
    parameters = moved(study, names)
    mechanism = study.resolved["mechanism"]
    # An expression of a target is evaluated with the parameters at hand; the numbers of a list are not.
    read = [study.resolved.get(name) for name in sections]
    read += [target for target in (mechanism.get("targets") or {}).values() if not isinstance(target, str)]
    if any(_mentions(part, parameters) for part in read):
        return True
    if not study.parameters.measured:
        return False
    return _mentions(mechanism.get("sketch"), parameters) or not _drawing(study).isdisjoint(places_of(study, names))


def _drawing(study: Study) -> set[str]:
    """Places that have a part in how links lie on the sketch, of links of which something is measured there."""
    links, joints = study.mechanism.description.links, study.mechanism.description.joints
    owners: set[str] = set()
    for place in study.parameters.measured:
        joint = joints.get(place.rpartition(".")[0])
        owners.update(joint.links if isinstance(joint, Fixed) else (place.partition(".")[0],))
    points = {point for name in owners for point in (*links[name].points, *(links[name].ends or ()))}
    found = {f"{name}.length" for name in owners if len(links[name].points) > 2}
    # The ground's points lie on the sketch where its numbers say.
    placed = [(name, point) for name in owners for point in links[name].points]
    placed += [(GROUND, point) for point in links[GROUND].points if point in points]
    return found | {f"{name}.{point}.{axis}" for name, point in placed for axis in "xy"}


def _mentions(data: Any, names: Collection[str]) -> bool:
    """Whether a text of the data is an expression in which one of the names stands."""
    for _, text in leaves(data) if names else ():
        with contextlib.suppress(ExpressionError):
            if isinstance(text, str) and not Expression.parse(text).names.isdisjoint(names):
                return True
    return False


def changed_data(study: Study, changed: Mapping[str, float]) -> dict[str, Any]:
    """The study as plain data with other values: what its file would be."""
    data: dict[str, Any] = plain(study.resolved)
    mechanism = data["mechanism"]
    for name, value in changed.items():
        owner, _, last = name.rpartition(".")
        holder: Any = mechanism
        key: str | int = last
        if name in study.parameters.nominal:
            holder, key = mechanism["parameters"], name
        elif owner.startswith("limits."):
            holder = mechanism["limits"][int(owner.partition(".")[2])]
        elif last in ("direction", "angle"):
            holder = mechanism["joints"][owner]
        elif last == "length":
            link = mechanism["links"][owner]
            if isinstance(link, list):
                link[2:] = [float(value)]
                continue
            holder = link
        else:
            link, _, point = owner.rpartition(".")
            holder, key = _points(study, mechanism["links"], link)[point], "xy".index(last)
        holder[key] = float(value)
    return data


def _points(study: Study, links: dict[str, Any], name: str) -> dict[str, list[Any]]:
    """The points of a link in its data, brought to the form ``{P: [x, y]}``; those measured become numbers."""
    described, numbers = study.mechanism.description.links[name], study.mechanism.nominal
    raw = dict(zip(LINK_KEYS, links[name], strict=False)) if isinstance(links[name], list) else dict(links[name])
    given = raw.get("points") if any(key in raw for key in LINK_KEYS) else raw
    known = given if isinstance(given, dict) else {}
    points = {
        point: known.get(point) or [numbers[term] if isinstance(term, str) else term for term in terms]
        for point, terms in described.points.items()
        if point not in (described.ends or ())
    }
    links[name] = points if described.ends is None else {**raw, "points": points}
    return points

"""Checks of the reliability section against the mechanism: what varies, and what its errors are limited to.

Where a pin has a clearance its links have that point in places of their own. The clearance moves the pin in one link;
the point's coordinates are those of the other links. An output or a limit may name its link, ``coupler.P.x``, and then
the pin moves in another one.
"""

from __future__ import annotations

from collections.abc import Mapping

from mechdesign.mechanism.graph import Graph
from mechdesign.study.building.names import Names
from mechdesign.study.schema.checker import NO_MOMENT, ORDERS, Checker
from mechdesign.study.schema.reliability import (
    LOADS,
    SUFFIXES,
    Clearance,
    Dimension,
    ErrorLimit,
    ReliabilitySection,
    split_order,
)
from mechdesign.study.text.document import KeyPath

# Digits of a clearance beyond which its lowest value is zero.
_ROUNDING = 1e-9


def check(checker: Checker, section: ReliabilitySection) -> ReliabilitySection:
    """Note what is wrong; returns the section with wildcards and the clearances' links filled in."""
    meant = _links_of_points(checker, section)
    dimensions = _dimensions(checker, section)
    clearances = {
        point: found
        for point, clearance in section.clearances.items()
        if (found := _clearance(checker, point, clearance, meant.get(point))) is not None
    }
    for name, limit in section.limits.items():
        _limit(checker, section, name, limit)
    for index, correlated in enumerate(section.correlation):
        for place, name in enumerate((correlated.one, correlated.other)):
            checker.known(name, dimensions, "varying dimension", ("reliability", "correlation", index, place))
    pairs = [frozenset(pair[:2]) for pair in section.correlation]
    for index, pair in enumerate(pairs):
        if pair in pairs[:index]:
            checker.report(("reliability", "correlation", index), "this pair is given twice")
    if not section.methods:
        checker.report(("reliability", "methods"), "name at least one method")
    for index, method in enumerate(section.methods):
        if method in section.methods[:index]:
            checker.report(("reliability", "methods", index), f"{method!r} is given twice")
    if section.allocate is not None:
        _allocate(checker, section, dimensions, clearances)
    load = _load(checker, section, dimensions)
    plain = {name: split_link(checker.names, name)[1] for name in (*(section.outputs or ()), *section.limits)}
    limits = {plain[name]: limit for name, limit in section.limits.items()}
    if len(limits) < len(section.limits):
        checker.report(("reliability", "limits"), "the same error is limited twice")
    outputs = None if section.outputs is None else tuple(plain[name] for name in section.outputs)
    checker.outputs(outputs, ("reliability", "outputs"))
    return section.model_copy(
        update={"dimensions": dimensions, "clearances": clearances, "load": load, "outputs": outputs, "limits": limits}
    )


def _point_of(names: Names, name: str) -> str:
    """The point that the name of an error is about; empty where it is about none."""
    for suffix in reversed(SUFFIXES):
        base = name.removesuffix(suffix).removesuffix(".x").removesuffix(".y")
        if base in names.owners:
            return base
    return ""


def split_link(names: Names, name: str) -> tuple[str, str, str]:
    """The link that a coordinate or point is said to be of, or nothing, the name without it, and the point."""
    link, _, rest = name.partition(".")
    if name in names.coordinates or link not in names.section.links or not (point := _point_of(names, rest)):
        return "", name, ""
    return link, rest, point


def _links_of_points(checker: Checker, section: ReliabilitySection) -> dict[str, str]:
    """The link that outputs and limits mean by each point, where they say; what contradicts itself is noted."""
    found: dict[str, str] = {}
    given: list[tuple[KeyPath, str, bool]] = [
        *((("reliability", "outputs", k), name, False) for k, name in enumerate(section.outputs or ())),
        *((("reliability", "limits", name), name, True) for name in section.limits),
    ]
    for path, name, at_key in given:
        link, _, point = split_link(checker.names, name)
        if not link:
            continue
        links = checker.names.owners[point]
        if link not in links:
            message = f"link {link!r} has no point {point!r}; it belongs to {' and '.join(links)}"
            checker.report(path, message, at_key=at_key)
        elif found.setdefault(point, link) != link:
            message = f"{point!r} is that of link {found[point]!r} elsewhere; all outputs and limits mean one of them"
            checker.report(path, message, at_key=at_key)
        own = section.clearances.get(point)
        if own is not None and link in links and (own.link == link or len(links) < 2):
            message = (
                f"the clearance of {point!r} moves its pin in link {link!r}, and the coordinates of {point!r} are "
                "those of what else it joins; give reliability.clearances another 'link', or none"
            )
            checker.report(path, message, at_key=at_key)
    return found


def _carrier(links: list[str], meant: str | None) -> str:
    """The link that a pin moves in where the study does not say: the last one of those that are not meant."""
    return ([link for link in links if link != meant] or links)[-1]


def _load(checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension]) -> tuple[float, ...] | None:
    """The load as fx, fy, mz."""
    path: KeyPath = ("reliability", "load")
    report, stiffness = checker.report, checker.parts.get("stiffness")
    random = [name for name in LOADS if name in dimensions]
    if checker.reporter.raw(("stiffness",)) is None:
        missing = "a load acts at the point of the stiffness section, and the study has none"
        if section.load is not None:
            report(path, missing)
        for name in random:
            report(("reliability", "dimensions", name), missing, at_key=True)
    on_pin = stiffness is not None and stiffness.link is None
    if on_pin and "load.mz" in random:
        report(("reliability", "dimensions", "load.mz"), NO_MOMENT, at_key=True)
    return None if section.load is None else checker.load(section.load, path, on_pin=on_pin)


def _allocate(
    checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension], clearances: dict[str, Clearance]
) -> None:
    assert section.allocate is not None
    for name in section.allocate.cost:
        known = [*dimensions, *clearances]
        checker.known(name, known, "dimension or clearance that varies,", ("reliability", "allocate", "cost", name),
                      at_key=True)  # fmt: skip
    if not section.limits:
        checker.report(("reliability", "allocate"), "tolerances are allocated to keep 'limits'; give some")
    wide = [name for name, dimension in dimensions.items() if name not in LOADS and _varies(dimension)]
    if not wide and not section.allocate.cost:
        message = "nothing to allocate: no dimension has a tolerance, and a clearance is held unless 'cost' names it"
        checker.report(("reliability", "allocate"), message)


def _varies(dimension: Dimension) -> bool:
    return bool(dimension.sigma) if dimension.tolerance is None else dimension.tolerance[0] < dimension.tolerance[1]


def _clearance(checker: Checker, point: str, clearance: Clearance, meant: str | None) -> Clearance | None:
    path: KeyPath = ("reliability", "clearances", point)
    names, report = checker.names, checker.reporter.report
    if not checker.known(point, names.owners, "point", path, at_key=True):
        return None
    links = names.owners[point]
    held = [*links, *(j.slot for j in names.section.joints.values() if j.slot and j.point == point)]
    if len(held) < 2:
        report(path, f"only link {links[0]!r} has point {point!r}: no pin, no clearance", at_key=True)
    link = clearance.link or _carrier(links, meant)
    if link not in links:
        checker.known(link, links, f"link at point {point!r} named", (*path, "link"))
    elif clearance.effect == "length":
        binary = names.section.links[link]
        if point not in (binary.from_, binary.to) or binary.telescopic:
            message = f"changes a binary link's length, and {point!r} is no end of such a link in {link!r}"
            report((*path, "effect"), message)
    checker.kind((*path, "tolerance"), "length")
    spread = clearance.radius_spread
    if spread is not None and spread.tolerance is not None and clearance.radius + spread.tolerance[0] < -_ROUNDING:
        factor = 1.0 if clearance.radial is not None else 2.0
        size, lowest = factor * clearance.radius, clearance.tolerance[0]
        message = f"a clearance of {size:g} that is {-lowest:g} smaller is negative: such a pin does not go in its hole"
        report((*path, "tolerance"), message)
    if spread is not None and spread.distribution == "lognormal" and clearance.radius <= 0:
        report((*path, "distribution"), "what is lognormal is positive, and so is its nominal value")
    return clearance.model_copy(update={"link": link})


def _limit(checker: Checker, section: ReliabilitySection, name: str, limit: ErrorLimit) -> None:
    path: KeyPath = ("reliability", "limits", name)
    names, report = checker.names, checker.reporter.report
    known = names.owners if limit.radius is not None else {**names.coordinates, **names.owners}
    name = split_link(names, name)[1]
    base, order = split_order(name, known.__contains__)
    if order and not (section.rates or section.accelerations or section.speed):
        report(path, "a limit of a velocity or an acceleration needs 'rates' or a 'speed'", at_key=True)
    if limit.radius is not None:
        if checker.known(base, names.owners, "point", path, at_key=True):
            checker.kind(path, ORDERS["length"][order])
    elif base in names.owners:
        report(path, f"{name!r} is a point: limit {name}.x and {name}.y, or {{radius: r}}", at_key=True)
    else:
        quantity = checker.coordinate(base, path, at_key=True)
        if quantity in ORDERS:
            checker.kind(path, ORDERS[quantity][order])


def _dimensions(checker: Checker, section: ReliabilitySection) -> dict[str, Dimension]:
    """Dimensions with wildcards expanded; a dimension that is named itself wins over a wildcard."""
    found: dict[str, Dimension] = {}
    parameters, report = checker.parameters, checker.reporter.report
    for name, dimension in section.dimensions.items():
        path: KeyPath = ("reliability", "dimensions", name)
        if "*" in name or "?" in name:
            matching = parameters.match(name)
            if not matching:
                report(path, f"no dimension matches {name!r}", at_key=True)
            for place in matching:
                _dimension(checker, place, dimension, path)
                if place not in section.dimensions:
                    found[place] = dimension
            continue
        if name in parameters.formulas:
            message = f"parameter {name!r} follows from others by its expression; give those a tolerance"
            report(path, message, at_key=True)
        known = [*parameters.known(), *checker.names.drives, *LOADS]
        if checker.known(name, known, "parameter, dimension or drive", path, at_key=True):
            _dimension(checker, name, dimension, path)
            found[name] = dimension
    return found


def _dimension(checker: Checker, name: str, dimension: Dimension, path: KeyPath) -> None:
    if dimension.distribution == "lognormal":
        nominal = checker.parameters.nominal.get(name)
        if name in checker.names.drives or name in LOADS or (nominal is not None and nominal <= 0):
            checker.report(path, "what is lognormal is positive, and so is its nominal value", at_key=True)
    if name in checker.parameters.nominal:
        return
    if name in LOADS:
        kind = LOADS[name]
    elif name in checker.places:
        kind = checker.places[name].quantity
    else:
        kind = checker.names.drives[name]
    checker.kind(path, kind)


def others(section: ReliabilitySection | None, graph: Graph) -> Mapping[str, tuple[str, list[str]]]:
    """Of each point with a clearance the link that its pin moves in, and those whose point its coordinates are."""
    found: dict[str, tuple[str, list[str]]] = {}
    for point, clearance in (section.clearances if section is not None else {}).items():
        links = [body.removesuffix(":rod") for body, name in graph.points if name == point]
        found[point] = clearance.link or "", [link for link in dict.fromkeys(links) if link != clearance.link]
    return found


def in_words(section: ReliabilitySection | None, graph: Graph) -> list[str]:
    """One line for each clearance."""
    return [
        f"clearance: the pin {point} moves in {link}; {point}.x and {point}.y are those of "
        f"{' and '.join(rest) or 'the joint'}"
        for point, (link, rest) in others(section, graph).items()
    ]

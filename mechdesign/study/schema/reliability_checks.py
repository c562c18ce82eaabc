"""Checks of the reliability section against the mechanism: what varies, and what its errors are limited to."""

from __future__ import annotations

from mechdesign.mechanism.model import Quantity
from mechdesign.study.schema import pin_links
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.reliability import (
    LOADS,
    Clearance,
    Dimension,
    ErrorLimit,
    ReliabilitySection,
    split_order,
)
from mechdesign.study.text.document import Path

# Digits of a clearance beyond which its lowest value is zero.
_ROUNDING = 1e-9

_KINDS: dict[Quantity, tuple[str, str, str]] = {
    "length": ("length", "velocity", "acceleration"),
    "angle": ("angle", "angular_velocity", "angular_acceleration"),
}


def check(checker: Checker, section: ReliabilitySection) -> ReliabilitySection:
    """Note what is wrong; returns the section with wildcards and the clearances' links filled in."""
    meant = pin_links.said(checker, section)
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
            checker.reporter.report(("reliability", "correlation", index), "this pair is given twice")
    if not section.methods:
        checker.reporter.report(("reliability", "methods"), "name at least one method")
    for index, method in enumerate(section.methods):
        if method in section.methods[:index]:
            checker.reporter.report(("reliability", "methods", index), f"{method!r} is given twice")
    if section.allocate is not None:
        _allocate(checker, section, dimensions, clearances)
    load = _load(checker, section, dimensions)
    plain = {name: pin_links.split_link(checker.names, name)[1] for name in (*(section.outputs or ()), *section.limits)}
    limits = {plain[name]: limit for name, limit in section.limits.items()}
    if len(limits) < len(section.limits):
        checker.reporter.report(("reliability", "limits"), "the same error is limited twice")
    outputs = None if section.outputs is None else tuple(plain[name] for name in section.outputs)
    return section.model_copy(
        update={"dimensions": dimensions, "clearances": clearances, "load": load, "outputs": outputs, "limits": limits}
    )


def _load(checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension]) -> tuple[float, ...] | None:
    """The load as fx, fy, mz."""
    path: Path = ("reliability", "load")
    report, stiffness = checker.reporter.report, checker.parts.get("stiffness")
    random = [name for name in LOADS if name in dimensions]
    if checker.reporter.raw(("stiffness",)) is None:
        missing = "a load acts at the point of the stiffness section, and the study has none"
        if section.load is not None:
            report(path, missing)
        for name in random:
            report(("reliability", "dimensions", name), missing, at_key=True)
    pin = stiffness is not None and stiffness.link is None
    message = "a pin carries no moment; name the 'link' of the stiffness section that is loaded"
    if pin and "load.mz" in random:
        report(("reliability", "dimensions", "load.mz"), message, at_key=True)
    load = section.load
    if load is None:
        return None
    if len(load) not in ((2, 3) if pin else (3,)):
        report(path, f"a load is [fx, fy, mz], not {len(load)} numbers")
        return (0.0, 0.0, 0.0)
    for place, kind in enumerate(list(LOADS.values())[: len(load)]):
        checker.kind((*path, place), kind)
    if pin and len(load) == 3 and load[2]:
        report((*path, 2), message)
    return (*load, 0.0)[:3]


def _allocate(
    checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension], clearances: dict[str, Clearance]
) -> None:
    assert section.allocate is not None
    for name in section.allocate.cost:
        known = [*dimensions, *clearances]
        checker.known(name, known, "dimension or clearance that varies,", ("reliability", "allocate", "cost", name),
                      at_key=True)  # fmt: skip
    if not section.limits:
        checker.reporter.report(("reliability", "allocate"), "tolerances are allocated to keep 'limits'; give some")
    wide = [name for name, dimension in dimensions.items() if name not in LOADS and _varies(dimension)]
    if not wide and not section.allocate.cost:
        message = "nothing to allocate: no dimension has a tolerance, and a clearance is held unless 'cost' names it"
        checker.reporter.report(("reliability", "allocate"), message)


def _varies(dimension: Dimension) -> bool:
    return bool(dimension.sigma) if dimension.tolerance is None else dimension.tolerance[0] < dimension.tolerance[1]


def _clearance(checker: Checker, point: str, clearance: Clearance, meant: str | None) -> Clearance | None:
    path: Path = ("reliability", "clearances", point)
    names, report = checker.names, checker.reporter.report
    if not checker.known(point, names.owners, "point", path, at_key=True):
        return None
    links = names.owners[point]
    held = [*links, *(j.slot for j in names.section.joints.values() if j.slot and j.point == point)]
    if len(held) < 2:
        report(path, f"only link {links[0]!r} has point {point!r}: no pin, no clearance", at_key=True)
    link = clearance.link or pin_links.carrier(links, meant)
    if link not in links:
        checker.known(link, links, f"link at point {point!r} named", (*path, "link"))
    elif clearance.effect == "length":
        binary = names.section.links[link]
        if point not in (binary.from_, binary.to) or binary.telescopic:
            message = f"changes a binary link's length, and {point!r} is no end of such a link in {link!r}"
            report((*path, "effect"), message)
    _spread_kind(checker, (*path, "tolerance"), "length")
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
    path: Path = ("reliability", "limits", name)
    names, report = checker.names, checker.reporter.report
    known = names.owners if limit.radius is not None else {**names.coordinates, **names.owners}
    name = pin_links.split_link(names, name)[1]
    base, order = split_order(name, known.__contains__)
    if order and not (section.rates or section.accelerations or section.speed):
        report(path, "a limit of a velocity or an acceleration needs 'rates' or a 'speed'", at_key=True)
    if limit.radius is not None:
        if checker.known(base, names.owners, "point", path, at_key=True):
            checker.kind((*path, "radius"), _KINDS["length"][order])
    elif base in names.owners:
        report(path, f"{name!r} is a point: limit {name}.x and {name}.y, or {{radius: r}}", at_key=True)
    else:
        quantity = checker.coordinate(base, path, at_key=True)
        if quantity in _KINDS:
            for key in ("min", "max"):
                checker.kind((*path, key), _KINDS[quantity][order])


def _dimensions(checker: Checker, section: ReliabilitySection) -> dict[str, Dimension]:
    """Dimensions with wildcards expanded; a dimension that is named itself wins over a wildcard."""
    found: dict[str, Dimension] = {}
    parameters, report = checker.parameters, checker.reporter.report
    for name, dimension in section.dimensions.items():
        path: Path = ("reliability", "dimensions", name)
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


def _dimension(checker: Checker, name: str, dimension: Dimension, path: Path) -> None:
    if dimension.distribution == "lognormal":
        nominal = checker.parameters.nominal.get(name)
        if name in checker.names.drives or name in LOADS or (nominal is not None and nominal <= 0):
            checker.reporter.report(path, "what is lognormal is positive, and so is its nominal value", at_key=True)
    if name in checker.parameters.nominal:
        return
    if name in LOADS:
        kind = LOADS[name]
    elif name in checker.parameters.factors:
        kind = "angle" if checker.is_angle(name) else "length"
    else:
        kind = checker.names.drives[name]
    _spread_kind(checker, (*path, "tolerance"), kind)
    checker.kind((*path, "sigma"), kind)


def _spread_kind(checker: Checker, path: Path, kind: str) -> None:
    """Units of a half-width, or of two bounds."""
    checker.kind(path, kind)
    for index in range(2):
        checker.kind((*path, index), kind)

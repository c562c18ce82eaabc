"""Tables of a drawing sheet: sizes of links, plates, pins, wheels and cams, the motion, and what is required."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.door.exporting.view import PosedStudy
from mechdesign.door.exporting.wheels import wheels_of
from mechdesign.door.report.requirements import requirements
from mechdesign.drawing.dimensions import table_rows, tolerance_of
from mechdesign.drawing.scene import Still
from mechdesign.ground.numerals import numeral, printed
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.rounding import STILL, cleared
from mechdesign.ground.results import Result
from mechdesign.ground.table_text import Rounding
from mechdesign.mechanism.cams import CamFollower
from mechdesign.mechanism.elements.plates import NO_CLASS
from mechdesign.mechanism.plates import pins_of
from mechdesign.mechanism.wheels import Mesh
from mechdesign.questions.reliability.schema.variation import ToleranceClass
from mechdesign.study import Study

# Rows of a table at most.
MOST = {
    "links": 20, "pivots": 12, "plates": 12, "pins": 12, "wheels": 10, "cams": 6, "laws": 6, "motion": 16,
    "requirements": 10,
}  # fmt: skip
# Part of a length of the study by which the profile of a cam may be missed where its base circle is sought.
FINE = 1e-5

# Rows of a table, of which the first is its head.
Rows = Sequence[Sequence[str]]


def sheet_tables(view: PosedStudy, scene: Still, result: Result | None) -> list[Rows]:
    """The tables that have rows, each with so many as there is room for; `result` is that of kinematics, if any."""
    tables = {
        "links": table_rows(view.study, scene, pivots=False), "pivots": _pivots(view.study, scene),
        "plates": _plates(view), "pins": _pins(view), "wheels": _wheels(view), "cams": _cams(view),
        "laws": _laws(view), **({} if result is None else {"motion": _motion(view, result)}),
        **({} if result is None else {"requirements": _requirements(view.study, result)}),
    }  # fmt: skip
    return [_shortened(name, rows) for name, rows in tables.items() if len(rows) > 1]


def general_tolerance(study: Study) -> str:
    """The class of all dimensions that have no tolerance of their own: what plates say, else the one of reliability."""
    plates = study.mechanism.description.plates
    if plates is not None and plates.general_tolerance != NO_CLASS:
        return plates.general_tolerance
    dimensions = study.reliability.dimensions.values() if study.reliability is not None else ()
    given = [one.tolerance.text for one in dimensions if isinstance(one.tolerance, ToleranceClass)]
    classes = {text for text in given if text.upper().startswith("ISO")}
    return classes.pop() if len(classes) == 1 else "none is given"


def _number(value: float, size: float) -> str:
    """A length; 0 of what is rounding beside a size."""
    return numeral(float(cleared(np.asarray(value), STILL * size)), 5)


def _pivots(study: Study, scene: Still) -> list[tuple[str, ...]]:
    """Places of the pivots of the ground, with their tolerances."""
    rows: list[tuple[str, ...]] = [("pivot", "x", "y")]
    for point in scene.pivots():
        place = scene.points[point]
        x, y = (
            f"{_number(value, scene.span)} {tolerance_of(study, f'ground.{point}.{axis}')}".rstrip()
            for axis, value in (("x", place.real), ("y", place.imag))
        )
        rows.append((point, x, y))
    return rows


def _plates(view: PosedStudy) -> list[tuple[str, ...]]:
    """Width, thickness and layer of plates; those that are alike in one row."""
    plates, sizes = view.mechanism.description.plates, view.sizes
    if plates is None:
        return []
    alike: dict[tuple[str, ...], list[str]] = {}
    for link in view.mechanism.description.links:
        layer = str(plates.layers.get(link, ""))
        width, thickness = f"{2 * float(sizes.radius(link)):.5g}", f"{float(sizes.thickness):.5g}"
        alike.setdefault((width, thickness, layer), []).append(link)
    kept = 3 if plates.layers else 2
    head = ("plate", "width", "thickness", "layer")[: kept + 1]
    return [head, *((", ".join(links), *numbers[:kept]) for numbers, links in alike.items())]


def _wheels(view: PosedStudy) -> list[tuple[str, ...]]:
    """Both wheels of each mesh: teeth, module, radii of the pitch circles, distance of the axes, pressure angle."""
    rows: list[tuple[str, ...]] = [
        ("wheels", "link", "teeth", "module", "pitch radius", "centre distance", "pressure angle")
    ]
    for mesh in view.mechanism.meshes:
        wheels, scale = wheels_of(view, mesh), view.millimetres
        for k, wheel in enumerate(wheels):
            module = f"{wheel.module / scale:.5g}" if wheel.module else "" if mesh.belt else "not given"
            ring = " (ring)" if wheel.ring else ""
            own = (f"{wheel.link}{ring}", wheel.teeth, module, f"{wheel.pitch / scale:.5g}")
            rows.append((mesh.coupling, *own, *_of_pair(view, mesh)) if k == 0 else ("", *own, "", ""))
    return rows


def _of_pair(view: PosedStudy, mesh: Mesh) -> tuple[str, str]:
    """Distance of the axes of wheels, and the pressure angle of teeth."""
    one, other = (view.pose.nodes[axis] for axis in mesh.axes)
    apart = "rack" if mesh.slide >= 0 else f"{float(np.abs(one - other)):.5g}"
    return apart, "belt" if mesh.belt else f"{np.degrees(mesh.pressure_angle):.4g}\N{DEGREE SIGN}"


def _cams(view: PosedStudy) -> list[tuple[str, ...]]:
    """Cams with their base circle, the roller or face of the follower, and its lift."""
    rows: list[tuple[str, ...]] = [("cam", "link", "base radius", "follower", "from", "to", "lift")]
    for cam in view.mechanism.cams:
        follower = f"flat face through {view.mechanism.graph.nodes[cam.node]}"
        if not cam.flat:
            radius = float(cam.roller(view.pose))
            follower = f"roller of radius {radius:.5g}" if radius else "knife edge"
        ends = np.asarray(cam.along(cam.values).value(cam.follower)) / (
            view.study.units.angle_factor if cam.follower.quantity == "angle" else 1.0
        )
        low, high = _ends(ends)
        unit = printed(view.study.units.label(cam.follower.quantity))
        values = (f"{value:.5g} {unit}".rstrip() for value in (low, high, high - low))
        rows.append((cam.coupling, cam.links[1], _base(view, cam), follower, *values))
    return rows


def _base(view: PosedStudy, cam: CamFollower) -> str:
    """Radius of the circle about the origin of the cam that its profile touches; none of a cam that does not turn."""
    if cam.followed.quantity != "angle":
        return ""
    ends = _ends(np.abs(cam.cut(cam.sides[0], 0.0, FINE * view.mechanism.size)))
    return f"{ends[cam.sides[0] == 'inner']:.5g}"


def _ends(values: Floats) -> tuple[float, float]:
    """The smallest and the largest of those that are numbers."""
    finite = values[np.isfinite(values)]
    return float(finite.min(initial=np.inf)), float(finite.max(initial=-np.inf))


def _laws(view: PosedStudy) -> list[tuple[str, ...]]:
    """What followers of cams do, as the study has it."""
    couplings = view.mechanism.description.couplings
    told = [(name, f"{one.set_}: {one.function.text}") for name, one in couplings.items() if one.cam is not None]
    return [("law", "of the follower"), *told]


def _motion(view: PosedStudy, result: Result) -> list[tuple[str, ...]]:
    """Ranges of drives and outputs, and least transmission angles."""
    label = view.study.units.label
    rows: list[tuple[str, ...]] = [("motion", "from", "to", "range", "unit")]
    poses = result.tables["motion"]
    for name in view.mechanism.drives:
        if name in poses.names:
            values = poses[name]
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            unit = printed(poses.column(name).unit)
            rows.append((f"drive {name}", numeral(low, 5), numeral(high, 5), numeral(high - low, 5), unit))
    if "extremes" in result.tables:
        table = result.tables["extremes"]
        rounding = Rounding.of(table.columns, view.study.size)
        for number, output in enumerate(table["output"].tolist()):
            if not output.endswith(("_velocity", "_acceleration", "_error")):
                ends = (table.column(name) for name in ("min", "max", "range"))
                numbers = (rounding.cell(table.columns, number, end, 5) for end in ends)
                rows.append((output, *numbers, printed(str(table["unit"][number]))))
    if "loops" in result.tables:
        for row in result.tables["loops"]:
            least = numeral(row["transmission_min"], 4)
            rows.append((f"least transmission angle, {row['joints']}", least, "", "", printed(label("angle"))))
    return rows


def _requirements(study: Study, result: Result) -> list[tuple[str, ...]]:
    """Verdicts on what is required."""
    verdicts = [
        (verdict.requirement, "met" if verdict.met else "NOT MET", f"{numeral(own.worst, 5)} {printed(own.unit)}")
        for verdict in requirements(study, result)
        for own in [verdict.as_required]
    ]
    return [("requirement", "", "worst"), *verdicts]


def _pins(view: PosedStudy) -> list[tuple[str, ...]]:
    """Pins of plates, with fits and clearances of the study."""
    study, description = view.study, view.mechanism.description
    clearances = study.reliability.clearances if study.reliability is not None else {}
    if description.plates is None and not clearances:
        return []
    rows: list[tuple[str, ...]] = [("pin", "joins", "diameter", "fit or clearance")]
    for pin in pins_of(description):
        clearance = clearances.get(pin.name)
        fit = ""
        if clearance is not None:
            fit = clearance.fit.text if clearance.fit is not None else f"radial {float(clearance.radius):.5g}"
        size = f"\N{DIAMETER SIGN}{2 * float(view.sizes.pin(pin.name)):.5g}" if description.plates is not None else ""
        rows.append((pin.name, ", ".join(pin.links), size, fit))
    kept = [k for k in range(4) if any(row[k] for row in rows[1:])]
    return [tuple(row[k] for k in kept) for row in rows]


def _shortened(name: str, rows: Rows) -> Rows:
    """A table with at most so many rows; the last one says how many more there are."""
    most = MOST[name] + 1
    if len(rows) <= most:
        return rows
    more = [f"and {len(rows) - most + 1} more", *([""] * (len(rows[0]) - 1))]
    return [*rows[: most - 1], more]

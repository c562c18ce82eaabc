"""The mechanism moving in a page: the poses of a result, as integers that a small script draws."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import tostring

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from mechdesign.door.report.cases import best_of
from mechdesign.door.report.page.axes import box
from mechdesign.door.report.page.frames import frames, largest
from mechdesign.door.report.page.linkage import Canvas, Sketcher, add, dashed
from mechdesign.door.report.page.roaming import roaming
from mechdesign.door.report.page.tracks import (
    PLACES,
    ROWS,
    TIMES,
    Cell,
    MovingPicture,
    ShownNumbers,
    deltas,
    gaps,
    meanings,
    places,
)
from mechdesign.door.report.page.vector import described, inline
from mechdesign.door.report.requirements import DrawnCases
from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.framing import extent
from mechdesign.drawing.layout import draw
from mechdesign.drawing.overlay import COLOR, DASHES
from mechdesign.drawing.panels import abscissa, round_down
from mechdesign.drawing.scene import Scene, Still
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import AssemblyError, MechdesignError
from mechdesign.ground.numerals import printed
from mechdesign.ground.numerics.arrays import Complexes, Floats, evenly
from mechdesign.ground.results import Result, Table
from mechdesign.mechanism import Reason
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import solve_rows
from mechdesign.questions.dynamics.figures.free_bodies import LOOKS
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.questions.kinematics.columns import MOTION
from mechdesign.questions.kinematics.drawn import DrawnMotion, DrawnPoses
from mechdesign.questions.kinematics.figures.curves import motion_curves
from mechdesign.questions.kinematics.figures.paths import goals_of, path_looks
from mechdesign.questions.optimize.analysis import DrawnDesigns
from mechdesign.questions.workspace.analysis import workspace
from mechdesign.study import Study
from mechdesign.study.schema.loads import EFFICIENCIES
from mechdesign.study.schema.poses import MotionSection

_FEW_POSES = 24  # whose guides fit into the window, and in which names avoid the links
# Duration of a motion on the screen (s): without rates, and the range in which its own duration is kept.
_SECONDS = 5.0
_SHORTEST, _LONGEST = 2.0, 12.0
_HAND_ROOM = 1.3  # size of a drawing that a hand changes, as a multiple of what it shows
_DASHED = 1.8  # width of a line whose dashes the mechanism before has
_ASTRAY = 0.05  # squared deviation of a step from what the rates predict, as a part of the squared step
_ARROW, _SHARE = 90.0, 0.3  # length of the longest arrow, and the part of a low drawing's height that it has at most
# What vectors are called, and the colours of their arrows.
_ARROWS = {
    "velocity": ("Velocities", style.VERMILION),
    "joint": ("Joint forces", LOOKS["joint"].color),
    "weight": ("Weights", LOOKS["weight"].color),
    "inertia": ("Inertia", LOOKS["inertia"].color),
    "load": ("Loads", LOOKS["load"].color),
    "spring": ("Springs", LOOKS["spring"].color),
    "effort": ("Drives", LOOKS["effort"].color),
    "coupling": ("Couplings", LOOKS["coupling"].color),
    "shaking": ("Shaking force", style.SKY),
}
_RATES = ("velocity", "acceleration")


def moving(
    study: Study, result: Result, before: Before | None = None, marked: Sequence[float] = (), *, plain: bool = False,
    sheet: Canvas | None = None, handled: bool = False,
) -> MovingPicture | None:  # fmt: skip
    """The moving mechanism of a result: along a sweep or path, or over the grid of a workspace.

    Of an optimisation it is that of the best design, of a sweep that of the best case. Beside a motion, and in its
    curves, stands that of the study before.
    `marked` are places of the motion, in rows of its table, that are among the poses drawn. A `plain` motion is the
    linkage with its paths, without names, ruler and curves; one that is `handled` has room for a hand around it, and no
    curves. A motion is drawn on a `sheet` where one is given, else on one that shows all of it.
    """
    command = result.command
    if isinstance(result.drawn, DrawnDesigns):
        best = result.drawn.best
        judged = best.region or best.motion
        if judged is None:
            return None
        study, result = best.study, judged
    title = ""
    if isinstance(result.drawn, DrawnCases):
        if (case := _best_case(result.drawn, result.main)) is None:
            return None
        title, study, result = case
    # A motion without curves is drawn by nobody else's settings.
    with nullcontext() if handled else style.context():
        if isinstance(result.drawn, DrawnPoses) and result.drawn.shown.poses.followed:
            part = _motion(
                study, result, result.drawn, f"{command}-curves", before, marked, sheet, plain=plain, handled=handled
            )
            return part and part.titled(title)
        return roaming(study, result, command) if "local" in result.tables else None


def _best_case(drawn: DrawnCases, table: Table) -> tuple[str, Study, Result] | None:
    """The best case of a sweep in words, its study and how that moves, or where it works; None without any."""
    if (best := best_of(table)) is None:
        return None
    study = drawn.case(best.case)
    if study.is_task:
        return None
    for ask in (kinematics, *([workspace] if study.workspace is not None else [])):
        # A study of poses without a motion, or of several drives, does not say how it moves.
        with suppress(MechdesignError):
            result = ask(study)
            if not isinstance(result.drawn, DrawnPoses) or result.drawn.shown.poses.followed:
                return best.words, study, result
    return None


def _motion(
    study: Study,
    result: Result,
    drawn: DrawnPoses,
    name: str,
    before: Before | None,
    marked: Sequence[float],
    sheet: Canvas | None,
    *,
    plain: bool,
    handled: bool,
) -> MovingPicture | None:
    """The mechanism along its sweep or path, with the curves of its outputs."""
    whole = Sweep.of(drawn.shown)
    sweep, motion, table = frames(drawn, result.tables[drawn.name], marked)
    if not len(sweep.valid) or len(sweep.rows) < 2:
        return None
    begin = int(sweep.valid[0])
    few = sweep.valid[evenly(len(sweep.valid), _FEW_POSES)]
    scenes = Scene(sweep.mechanism, sweep.configuration, whole.scene.travel).some(few.tolist())
    earlier = None if before is None else _earlier(DrawnMotion.of(before.result), sweep)
    if sheet is None:
        # Guides reach farther than points.
        ends = [end for scene in scenes for guide in scene.guides for end in guide.ends]
        reached = np.concatenate(
            [whole.extent, ends, *goals_of(study).values(), *([earlier.extent] if earlier else [])]
        )
        if handled:
            middle, wide, tall = extent(reached)
            reached = middle + _HAND_ROOM * complex(wide, tall) * np.array([-0.5, 0.5])
        sheet = Canvas.around(reached)
    numbers = ShownNumbers(table, sweep.rows, begin, study.size)
    headings, rows = _rows(table, numbers)
    data: dict[str, Any] = {"poses": len(sweep.rows), "first": begin, "returns": whole.returns}
    data |= _tracks(sheet, sweep, earlier)
    section = motion.question.section
    data |= _time(study, section, sweep, table, whole.returns)
    data |= {"arrows": _arrows(drawn, motion, sweep, sheet), "rows": deltas(sweep.poses.numbers[sweep.rows], ROWS)}
    data["course"] = _course(whole.poses)
    if before is not None and earlier is not None:
        data["before"]["title"] = f"Before: {before.names[1]}"
    data["given"] = []
    for column in [table.column(name) for name in sweep.poses.named if name in table]:
        unit = numbers.cell(column).unit
        data["given"].append([column.name, unit, numbers.scaled[column.name][0]])
    # What names a pose: the coordinates that are given, or the drives.
    keys = dict.fromkeys(
        tuple(name for name in names if name in table) for names in (sweep.poses.values, study.mechanism.drives)
    )
    data["keys"] = [[[name, *numbers.scaled[name][::2]] for name in key] for key in keys if key]
    over, looks = abscissa(study, sweep.poses, section.speed), path_looks(whole)
    own = table.column(over.name) if over.name in table else Column(over.label, over.values, "")
    which = numbers.add(own)
    data["over"] = [over.label, which, numbers.scaled[own.name][2], own.name in sweep.poses.values]
    data["traced"] = [[look.point, look.color] for look in looks if look.rank == looks[-1].rank]
    curves, beside, data["dots"] = None, "", []
    if isinstance(drawn, DrawnMotion) and not (handled or plain):
        curves = motion_curves(study, {**result.tables, "motion": table}, sweep.poses, before)
    if curves is not None:
        figure = draw(curves)
        beside = inline(figure, name, described(figure))
        data["dots"] = _dots(figure, table, numbers)
    data["numbers"] = numbers.tracks
    drawing = _drawing(study, whole, sheet, scenes, sweep.words(begin), earlier, plain=plain)
    replaces = ["motion"] * bool(beside) + ["paths"] * ("instant_centres" not in result.tables and before is None)
    return MovingPicture(drawing, beside, data, sweep.words(begin), headings, rows, meanings(table), replaces)


def posed(study: Study, rows: Floats, sheet: Canvas, earlier: Study) -> tuple[str, dict[str, Any]]:
    """The mechanism of a study at places of its motion, in rows, over that of an earlier one: drawing and tracks alone.

    This is what changes while a hand changes a dimension; numbers, names and arrows need the whole answer.

    Raises
    ------
    AssemblyError
        If it cannot be assembled at any of the places.
    """
    sweep, before = (_at_rows(one, rows) for one in (study, earlier))
    if not len(sweep.valid):
        raise AssemblyError(study.motion(sweep.poses).invalid_in_words(sweep.configuration.reason))
    begin = int(sweep.valid[0])
    under = before if study is not earlier and len(before.valid) else None
    scenes = Scene(sweep.mechanism, sweep.configuration, sweep.scene.travel).some([begin])
    drawing = _drawing(study, sweep, sheet, scenes, sweep.words(begin), under, plain=True)
    return drawing, _tracks(sheet, sweep, under)


def _at_rows(study: Study, rows: Floats) -> Sweep:
    """The poses of a study's motion at places between its rows."""
    poses = replace(study.motions["kinematics"], picked=(np.zeros(len(rows), dtype=np.intp), rows))
    every = np.arange(len(rows))
    return Sweep(study, poses, every, solve_rows(study.motion(poses), every))


def _tracks(sheet: Canvas, sweep: Sweep, earlier: Sweep | None) -> dict[str, Any]:
    """Where points and links of a motion are, and of that before, and where there are none."""
    configuration = sweep.configuration
    tracks = {**places(sheet, configuration, sweep.mechanism.description.links), "gaps": gaps(configuration)}
    if earlier is not None:
        tracks["before"] = places(sheet, earlier.configuration, earlier.mechanism.description.links)
    return tracks


def _earlier(drawn: DrawnMotion, sweep: Sweep) -> Sweep | None:
    """The motion before where what is given is as at the poses of a sweep; None where it is not known between poses.

    Of one coordinate that goes one way it is its value, else the part of the way.
    """
    if drawn.along is None or drawn.along.curve.spent.any():
        return None
    poses, rows = drawn.shown.poses, sweep.poses.numbers[sweep.rows]
    begin, end = 0.0, float(poses.end)
    places = rows * end / sweep.poses.end
    if len(sweep.poses.values) == 1:
        ((name, values),) = sweep.poses.values.items()
        then, numbers = poses.values[name], poses.numbers
        if (steps := np.diff(then)).all() and (np.sign(steps) == np.sign(steps[0])).all():
            order = np.argsort(then)
            places = np.interp(values[sweep.rows], then[order], numbers[order], left=np.nan, right=np.nan)
    gone = ~((places >= begin) & (places <= end))
    there = drawn.along.curve.solve(np.zeros(len(places), dtype=np.intp), np.where(gone, begin, places))
    reason = np.where(gone, np.int8(Reason.NO_VALUE), there.configuration.reason)
    configuration = replace(there.configuration, reason=reason)
    earlier = Sweep(drawn.shown.study, there.poses, there.rows, configuration)
    return earlier if len(earlier.valid) else None


def _drawing(
    study: Study, whole: Sweep, sheet: Canvas, scenes: Sequence[Still], words: str, earlier: Sweep | None, *,
    plain: bool,
) -> str:  # fmt: skip
    """The first of some valid poses, with the paths of the points, over the mechanism before."""
    scene = scenes[0]
    root = sheet.root(f"the mechanism at {words}")
    if earlier is not None and earlier.first is not None:
        under = add(root, "g", **{"class": "moving-part moving-before"}, opacity=0.6, stroke_linecap="butt")
        dashed(under, DASHES, _DASHED)
        Sketcher(under, sheet, earlier.first).draw(look._replace(color=COLOR) for look in path_looks(earlier))
    sketcher = Sketcher(root, sheet, scene)
    sketcher.draw(path_looks(whole), goals_of(study).values())
    if not plain:
        sketcher.names(scenes)
        sketcher.ruler(study.units.label("length"))
    return tostring(root, encoding="unicode")


def _rows(table: Table, numbers: ShownNumbers) -> tuple[list[str], list[tuple[str, list[Cell | None]]]]:
    """Numbers of a table: a row each output, with its rates beside it, and the speed of points."""
    columns = {column.name: column for column in table.columns if column.values.dtype.kind == "f"}
    columns.pop("conditioning", None)
    kinds = ["", *(rate for rate in _RATES if any(name.endswith(f"_{rate}") for name in columns))]
    names = [name for name in columns if not any(name.endswith(f"_{rate}") for rate in kinds[1:])]
    for point in [name[:-2] for name in names if name.endswith(".x")]:
        for rate in kinds[1:]:
            parts = [columns.get(f"{point}.{axis}_{rate}") for axis in "xy"]
            if parts[0] is not None and parts[1] is not None:
                values = np.hypot(parts[0].values, parts[1].values)
                columns[f"{point}_{rate}"] = Column(f"{point}_{rate}", values, parts[0].unit)
                names.append(point)
    rows = []
    for name in dict.fromkeys(names):
        cells = [columns.get("_".join(filter(None, (name, kind)))) for kind in kinds]
        # Those of dynamics have the same names.
        static = table.name == MOTION.name and (name.endswith("_effort") or name in EFFICIENCIES)
        shown = [None if column is None else numbers.cell(column) for column in cells]
        rows.append((f"{name} (static)" if static else name, shown))
    return ["value", *kinds[1:]], rows


def _course(poses: Poses) -> str:
    """What two questions along the same motion have in common."""
    parts = [part for name, values in poses.named.items() for part in (name.encode(), values.tobytes())]
    return hashlib.sha256(b" ".join(parts)).hexdigest()[:16]


def _time(study: Study, section: MotionSection, sweep: Sweep, table: Table, returns: bool) -> dict[str, Any]:
    """Time of each pose, of a motion over time or from the rates of a section if these follow it; else even."""
    unit = study.units.label("time")
    timed = None if sweep.poses.times is None else sweep.poses.times[sweep.rows]
    steps, own = _steps(sweep, table, section.rates) if timed is None else np.diff(timed), None
    times = np.linspace(0, 1, len(sweep.rows)) if steps is None else np.append(0.0, np.cumsum(np.abs(steps)))
    if sweep.poses.closed:
        times = np.append(times, times[-1] + np.diff(times).mean())
    seconds, note = _SECONDS, ""
    if steps is not None:
        own = float(times[-1])
        seconds = own if unit == "s" and _SHORTEST <= own <= _LONGEST else _SECONDS
        clause = "at the study's rates" if timed is None else "in the study's motion"
        note = f", as {clause}" if seconds == own else f"; {clause} {own:.3g} {unit}".rstrip()
    pace = f"1\N{MULTIPLICATION SIGN}: {seconds:.3g} s {'a round' if returns else 'from end to end'}{note}"
    return {"times": deltas(times / times[-1], TIMES), "seconds": round(seconds, 3), "pace": pace,
            "backwards": steps is not None and bool(steps[0] < 0)}  # fmt: skip


def _steps(sweep: Sweep, table: Table, rates: Mapping[str, float]) -> Floats | None:
    """Time from each pose to the next if the rates follow the motion, negative where they run against it; else None."""
    rows = sweep.rows
    rated = [name for name in table.names if f"{name}_velocity" in table or name in rates]
    # The drives if their rates are known: their rates are constant more often than those of other coordinates.
    names = [name for name in rated if name in sweep.poses.values] or rated
    if not names:
        return None
    values = np.array([table[name][rows] for name in names])
    rate = np.array([table[f"{name}_velocity"][rows] if f"{name}_velocity" in table else np.full(len(rows), rates[name])
                     for name in names])  # fmt: skip
    size = np.fmax.reduce(values, axis=1) - np.fmin.reduce(values, axis=1)
    step, mean = (part[size > 0] / size[size > 0, None] for part in (np.diff(values), (rate[:, 1:] + rate[:, :-1]) / 2))
    known = np.isfinite(step) & np.isfinite(mean)
    along, square, length = (np.where(known, part, 0.0).sum(axis=0) for part in (step * mean, mean**2, step**2))
    finite = square > 0
    if not finite.any():
        return None
    times = np.where(finite, along / np.where(finite, square, 1.0), np.nan)
    # Squared distance of each step from what the rates predict for its time.
    astray = length - 2 * times * along + times**2 * square
    if np.any(finite & ((times * times[finite][0] <= 0) | (astray > _ASTRAY * length))):
        return None
    return np.where(finite, times, np.nanmedian(times))


def _arrows(drawn: DrawnPoses, motion: PoseValues, sweep: Sweep, sheet: Canvas) -> list[dict[str, Any]]:
    """Vectors at the poses as arrows of the drawing: of each unit a round length, and a layer for each kind."""
    vectors = list(drawn.vectors(motion, sweep))
    groups = []
    for unit, longest in largest(vectors).items():
        scale, length = min(_ARROW, _SHARE * sheet.height) / longest, round_down(longest)
        layers = []
        for kind in vectors:
            if kind.unit == unit:
                title, color = _ARROWS[kind.kind]
                shafts = [[words, at if isinstance(at, str) else _track(sheet.all(at)), _track(np.conj(vector * scale))]
                          for words, at, vector in kind.arrows]  # fmt: skip
                layers.append({"title": title, "color": color, "on": kind.kind != "velocity", "shafts": shafts})
        groups.append({"key": [round(length * scale, 1), f"{length:g} {printed(unit)}".rstrip()], "layers": layers})
    return groups


def _track(places: Complexes) -> list[str]:
    """Places, or vectors, of the drawing as the script takes them."""
    return [deltas(places.real, PLACES), deltas(places.imag, PLACES)]


def _dots(figure: Figure, table: Table, numbers: ShownNumbers) -> list[list[Any]]:
    """Dots on the curves at the pose: panel, number, slope and place at 0 of its height, colour."""
    dots: list[list[Any]] = []
    for panel, axes in enumerate(figure.axes):
        (_, _, upper, lower), (bottom, top) = box(axes), axes.get_ylim()
        for line in axes.get_lines():
            drawn = np.asarray(line.get_ydata(), dtype=float)
            column = next((candidate for candidate in table.columns if candidate.values.dtype.kind == "f"
                           and np.array_equal(candidate.values, drawn, equal_nan=True)), None)  # fmt: skip
            if column is None or axes.get_yscale() != "linear":
                continue
            which = numbers.add(column)
            slope = (upper - lower) / (top - bottom)
            scaled = slope * 10.0 ** numbers.scaled[column.name][2]
            dots.append([panel, which, scaled, round(lower - slope * bottom, 2), to_hex(line.get_color())])
    return dots

"""A task and the linkages that do it, in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from mechdesign.ground.errors import counted
from mechdesign.ground.numerals import numeral, printed
from mechdesign.ground.results import Table
from mechdesign.questions.synthesize.columns import DEFECTS
from mechdesign.questions.synthesize.declared import BODIES, FOUR_BAR, in_words
from mechdesign.questions.synthesize.dyads import EXACTLY
from mechdesign.questions.synthesize.schema import RATIO, REACH
from mechdesign.questions.synthesize.sites import Site
from mechdesign.study import Study
from mechdesign.study.schema.variable import plainly
from mechdesign.study.text.csv_files import read_table
from mechdesign.study.variants import in_one_line

_DIGITS = 4


def linkage(table: Table, row: int, error: float) -> list[str]:
    """A row of the table of solutions: kind and class, `error` in the study's unit, transmission angle, defects."""

    def with_unit(name: str, value: float) -> str:
        return f"{numeral(value, _DIGITS)} {printed(table.column(name).unit)}".rstrip()

    words = [f"{in_words(str(table['kind'][row]))}" + (f" ({table['class'][row]})" if table["class"][row] else "")]
    words.append(f"error {with_unit('error', error)}")
    words.append(f"transmission angle {with_unit('transmission_angle', float(table['transmission_angle'][row]))}")
    # What comes nearest is not judged.
    if "yield" in table and np.isfinite(table["yield"][row]):
        share, low, high = (numeral(float(table[name][row]), _DIGITS) for name in ("yield", "yield_low", "yield_high"))
        words.append(f"yield {share} ({low} to {high})")
    if "peak_effort" in table and np.isfinite(table["peak_effort"][row]):
        words.append(f"peak effort {with_unit('peak_effort', float(table['peak_effort'][row]))}")
    defects = str(table["defects"][row])
    return [*words, f"defect: {defects}" if defects else "no defect"]


def faults(defects: str, elsewhere: Sequence[int]) -> Iterator[str]:
    """What keeps a linkage from moving through its task; `elsewhere` are positions, from 1, of another assembly."""
    for name in filter(None, defects.split(", ")):
        yield DEFECTS[name] + (f" ({', '.join(map(str, elsewhere))})" if name == "branch" else "")


def task(study: Study) -> Iterator[str]:
    """The task of a study, and what its section says besides, a line each; nothing without one."""
    section, units = study.synthesis, study.units
    if section is None:
        return
    length, angle = units.label("length"), units.label("angle")

    def extent(name: str, values: Iterable[float], unit: str) -> str:
        ordered = sorted(values)
        return f"{name} {numeral(ordered[0], _DIGITS)} to {numeral(ordered[-1], _DIGITS)} {printed(unit)}".rstrip()

    if section.body is not None:
        given = (Site.of(places, 0j, 1.0, REACH, 1.0) for places in (section.pivots, section.pins))
        what = f"a body through {_exactly(len(section.body), 'position', sum(sum(site.fixed) for site in given))}"
        ways = [extent(name, (getattr(part, name) for part in section.body), unit)
                for name, unit in (("x", length), ("y", length), ("angle", angle))]  # fmt: skip
    elif section.function is not None:
        what = f"a function through {_exactly(len(section.function.input), 'pair', 2 * (section.zeros == 'fixed'))}"
        unit = angle if section.output_kind == FOUR_BAR else length
        ways = [extent("input", section.function.input, angle), extent("output", section.function.output, unit)]
    else:
        assert section.path is not None
        points = section.path.points
        rows = read_table(study.folder, points).tolist() if isinstance(points, str) else points
        what = f"a {'closed ' * section.path.closed}path through {counted(len(rows), 'point')}"
        ways = [extent(name, (row[k] for row in rows), length) for k, name in enumerate("xy")]
        ways.append("at any crank angles" if section.path.timing is None else "at given crank angles")
    yield f"task: {what}: {', '.join(ways)}"
    kinds = section.kinds or (BODIES if section.body is not None else (section.output_kind,))
    yield f"linkages: {section.of or ', '.join(map(in_words, kinds))}"
    default: dict[str, Any] = {} if section.of else {"limits": {"reach": plainly(REACH), "ratio": plainly(RATIO)}}
    default |= {"zeros": section.zeros} if section.function is not None else {}
    for key, value in (default | study.resolved["synthesis"]).items():
        if key not in ("body", "function", "path", "kinds", "kind", "of"):
            yield in_one_line(key, value)


def _exactly(count: int, noun: str, wishes: int) -> str:
    return f"{counted(count, noun)} {'exactly' if count + wishes <= EXACTLY else 'by least squares'}"

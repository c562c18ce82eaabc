"""The report of a study as one HTML file that loads no other file, and the index of several reports."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from operator import itemgetter
from typing import Any

from mechdesign.commands import QUESTIONS, SWEEP
from mechdesign.door.report.manifest import computed_from
from mechdesign.door.report.page import vector
from mechdesign.door.report.page.headlines import shown
from mechdesign.door.report.page.pages import IndexEntry
from mechdesign.door.report.page.template import rendered
from mechdesign.door.report.page.tracks import joined
from mechdesign.door.report.requirements import Verdict, judged_by, named
from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.framing import fit
from mechdesign.drawing.layout import draw
from mechdesign.drawing.mechanism import sketch_picture
from mechdesign.drawing.scene import sketched
from mechdesign.ground.errors import explain
from mechdesign.ground.terms import path_of
from mechdesign.ground.versions import VERSION
from mechdesign.mechanism.describe import describe, drives_in_words, links_in_words
from mechdesign.questions.reliability.schema.section import in_words
from mechdesign.questions.synthesize.words import task as task_in_words
from mechdesign.study import Study
from mechdesign.study.schema.conditions import Requirement
from mechdesign.study.text.units import text_of

# Pixels of the drawings in an index, twice their width on the page.
_THUMBNAIL = (240, 180)
_FIRST_NUMBERS = 5  # at the top of a page

_Number = Mapping[str, Any]


@dataclass(frozen=True)
class AnsweredQuestion:
    """The outcome of one question."""

    command: str
    outcome: str  # in words
    exit_code: int
    failed: str = ""
    verdicts: Sequence[Verdict] = ()
    section: Mapping[str, Any] | None = None  # see `mechdesign.door.report.page.section`; None where nothing came out


def report(study: Study, answers: Sequence[AnsweredQuestion], *, below: bool, plots: bool = True) -> bytes:
    """The page of a study.

    Parameters
    ----------
    below : bool
        Whether the files of each question stand in a folder of its name below that of the page, or else beside it.
    plots : bool
        Whether pictures are wanted.
    """
    sections = [answer.section for answer in answers if answer.section is not None]
    warnings = [(str(warning), "") for warning in study.cautions]
    warnings += [(warning, section["command"]) for section in sections for warning in section["warnings"]]
    moving = together({section["command"]: section["moving"] for section in sections if section["moving"]})
    # The mechanism beside the answers moves through a motion, if there is one.
    lead = next((name for name, part in moving.items() if "given" in part["data"]), next(iter(moving), ""))
    parts = ["moving"] * bool(moving)
    parts += ["sorted"] * any(table["sorted"] for section in sections for table in section["tables"])
    drawing = next((section["mechanism"] for section in sections if section["mechanism"]), "")
    required = required_of(study, answers)
    drawing = drawing or (_sketch(study) if plots and not study.is_task else "")
    drawings = [drawing, *(part[key] for part in moving.values() for key in ("drawing", "beside"))]
    # Each design of a front has a drawing.
    drawings += [entry.get("drawing", "") for part in moving.values() for entry in part["data"].get("choices", ())]
    drawings += [picture["html"] for section in sections for picture in section["pictures"]]
    first, more = _divided({section["command"]: section["headlines"] for section in sections})
    return rendered(
        "report.html.j2",
        moving=moving,
        drawings=drawings,
        lead=lead,
        first=first,
        more=more,
        parts=parts,
        study=study,
        about=_about(study),
        drawing=drawing,
        plots=plots,
        answers=answers,
        mover=partial(mover, moving),
        pose_of=pose_of,
        questions=QUESTIONS,
        required=required,
        met=sum(entry["met"] for entry in required),
        warnings=warnings,
        below=below,
        made=computed_from(study, ""),
    )


def together(moving: Mapping[str, Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Mechanisms that move by their questions; of those along one motion the first alone, with what the others add."""
    firsts: dict[str, str] = {}
    parts: dict[str, Mapping[str, Any]] = {}
    for command, part in moving.items():
        first = firsts.setdefault(part["data"].get("course", command), command)
        parts[first] = part if first == command else joined(parts[first], part)
    return parts


def mover(
    moving: Mapping[str, Mapping[str, Any]], command: str, pose: Mapping[str, float] | None = None, words: str = ""
) -> str:
    """The question whose mechanism moves, and through poses like one: its own, or kinematics; empty without one.

    `words` say where the pose is: of the cases of a sweep one moves.
    """
    for name in dict.fromkeys((command, "kinematics")):
        data = moving[name]["data"] if name in moving else {}
        keys = data.get("keys", ()) if pose is None or words.startswith(data.get("title", "")) else ()
        if any(pose is None or {coordinate for coordinate, *_ in key} <= pose.keys() for key in keys):
            return name
    return ""


def pose_of(verdict: Verdict) -> dict[str, float]:
    """The numbers that the place of a verdict names, such as a pose."""
    numbers = {}
    for part in verdict.place.split(", "):
        name, _, value = part.rpartition(" ")
        with suppress(ValueError):
            numbers[name] = float(value)
    return numbers


def _divided(numbers: Mapping[str, Sequence[_Number]]) -> tuple[list[tuple[str, _Number]], dict[str, list[_Number]]]:
    """The key numbers at the top of the page, each with its question, and those that remain to each question.

    The questions take turns, and each gives its numbers in their order.
    """
    turns = [(k, place, command) for place, (command, own) in enumerate(numbers.items()) for k in range(len(own))]
    top = sorted(turns)[:_FIRST_NUMBERS]
    first = [(command, numbers[command][k]) for k, _, command in sorted(top, key=itemgetter(1, 0))]
    taken = Counter(command for *_, command in top)
    return first, {command: [*own[taken[command] :]] for command, own in numbers.items()}


def index(entries: Sequence[IndexEntry]) -> bytes:
    """The page of several studies, a row each: first those that will not do, then by their names."""
    entries = sorted(entries, key=lambda entry: (entry.verdict[0], entry.name.casefold(), entry.label))
    return rendered("index.html.j2", entries=entries, version=VERSION)


def _sketch(study: Study) -> str:
    """The sketch, if no question has drawn the mechanism; empty if it cannot be drawn."""
    try:
        with style.context():
            return vector.inline(draw(sketch_picture(study)), "sketch", "The sketch, assembled")
    except Exception:
        return ""


def thumbnail(study: Study) -> str:
    """A small drawing of a study's mechanism as a data URI; empty where it cannot be drawn, or there is none."""
    if study.is_task:
        return ""
    try:
        with style.context():
            scene = sketched(study.mechanism)
            width, height = (pixels / style.DPI for pixels in _THUMBNAIL)
            window = fit(scene.points.values(), width, height, 0.25)
            figure = style.new_figure(height)
            figure.set_size_inches(width, height)
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
            axes.set_axis_off()
            half = complex(width, height) / 2 / window.scale
            axes.set_xlim(window.middle.real - half.real, window.middle.real + half.real)
            axes.set_ylim(window.middle.imag - half.imag, window.middle.imag + half.imag)
            Posed(scene, names=False, drives=False).draw(axes)
            return f"data:image/png;base64,{base64.b64encode(style.encoded(figure)).decode()}"
    except Exception:
        return ""


def required_of(study: Study, answers: Iterable[AnsweredQuestion]) -> list[dict[str, Any]]:
    """The requirements of the questions that were asked, in the order of the study, each with its verdict.

    Those on warnings come after the others, and those of its cases, where they were asked, last.
    """
    rows: list[tuple[bool, int, dict[str, Any]]] = []
    rules = [
        *map(_in_words, study.requirements),
        *(
            {"result": named(kind), "where": "", "limit": "\N{LESS-THAN OR EQUAL TO} 0", "bare": True}
            for kind in study.barred
        ),
    ]
    of_warnings = range(len(study.requirements), len(rules))
    for answer in answers:
        meanings = _meanings(answer.section)
        for k, verdict in zip_longest([*judged_by(study, answer.command), *of_warnings], answer.verdicts):
            about = {"command": answer.command, "verdict": verdict, "met": verdict is not None and verdict.met}
            about |= {"meaning": meanings.get(rules[k]["result"].strip("|"), ""), **rules[k]}
            rows.append((answer.command == SWEEP.name, k, about))
    return [about for *_, about in sorted(rows, key=itemgetter(0, 1))]


def _meanings(section: Mapping[str, Any] | None) -> dict[str, str]:
    """Meanings of the columns of a result that have no unit, such as indices."""
    tables = section["tables"] if section is not None else ()
    columns = (column for table in tables for column in table["columns"])
    return {column["name"]: column["meaning"] for column in columns if column["numeric"] and not column["unit"]}


def _in_words(requirement: Requirement) -> dict[str, Any]:
    path = path_of(requirement.result)
    bounds = ("\N{GREATER-THAN OR EQUAL TO}", requirement.at_least), ("\N{LESS-THAN OR EQUAL TO}", requirement.at_most)
    return {
        "result": f"|{path}|" if requirement.abs else path,
        "where": ", ".join(f"{column} {value}" for column, value in requirement.where.items()),
        "limit": ", ".join(f"{sign} {text_of(bound) or shown(bound)}" for sign, bound in bounds if bound is not None),
        # A quantity has its unit already.
        "bare": not any(text_of(bound) for _, bound in bounds),
    }


def _about(study: Study) -> dict[str, Any]:
    """The mechanism in words, and its numbers."""
    mechanism, units = study.mechanism, study.units
    description, graph = mechanism.description, mechanism.graph
    try:
        lines = [*describe(mechanism).splitlines(), *in_words(study.reliability, graph, study.sizes)]
    except Exception as error:
        lines = [explain(error)[1]]
    listed: dict[str, list[str]] = {"joint": [], "limit": [], "measure": [], "clearance": []}
    rest = []
    for line in lines:
        kind, _, words = line.partition(": ")
        if kind in listed:
            listed[kind].append(words)
        elif kind not in ("links", "mobility"):
            rest.append(line.strip())
    links = [
        (link.name, ", ".join(link.points), "varies" if link.telescopic else shown(link.length) if link.length else "")
        for link in links_in_words(description)
    ]
    parameters = [(name, shown(value), study.unit_of(name) or "") for name, value in study.parameters.nominal.items()]
    loops = len(graph.edges) - len(graph.nodes) + 1
    return {
        "links": links, "drives": drives_in_words(description), "parameters": parameters, "described": listed,
        "solution": rest, "loops": loops,
        "mobility": mechanism.mobility, "length_unit": units.label("length"),
        "task": [*task_in_words(study)],
    }  # fmt: skip

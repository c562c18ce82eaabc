"""A task in the hand: its linkages side by side, its points to drag, and a page for each linkage that is taken over."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any
from xml.etree.ElementTree import tostring

import numpy as np

from mechdesign.commands import COMMANDS
from mechdesign.door.live.altered import POINTS, TASK, altered, path_points
from mechdesign.door.live.answers import DRAWING, PACKAGE
from mechdesign.door.live.fields import number_field
from mechdesign.door.live.requests import RequestError, changes_of, number_of
from mechdesign.door.live.saving import file_names, overrides
from mechdesign.door.live.served import Actions, ServedStudy
from mechdesign.door.live.session import Session
from mechdesign.door.report.page.dark import dark
from mechdesign.door.report.page.linkage import Canvas
from mechdesign.door.report.page.solutions import mark_task, solutions
from mechdesign.door.report.page.template import fragment, rendered
from mechdesign.drawing import style
from mechdesign.ground.errors import AssemblyError, StudyError, counted
from mechdesign.ground.progress import Progress
from mechdesign.ground.results import Result
from mechdesign.questions.look import ask
from mechdesign.questions.synthesize.analysis import DrawnSolutions
from mechdesign.questions.synthesize.declared import FOUR_BAR
from mechdesign.questions.synthesize.tasks import task_of
from mechdesign.questions.synthesize.words import task as task_in_words
from mechdesign.study import Study
from mechdesign.study.text.document import dotted, leaves, plain

_QUESTION = "synthesize"
_MOST_HANDLES = 60  # points of a task that are dragged; more are those of a drawn curve
_MOST_ANSWERS, _MOST_LINKAGES = 20, 30  # that are kept, the newest
_OWN = "own"  # name of the page of the study's own mechanism
_CONDITIONS = {"transmission": "angle", "lengths": "length", "keep_out": "length"}  # whose numbers have fields
_REACH, _TURN = 0.5, 90.0  # of sliders to both sides: as a part of the task's size, and in degrees


def session_of(study: Study, load: Callable[[], Study] | None = None) -> ServedStudy:
    """What the pages of a study ask: those of its task where it has one, else those of its mechanism."""
    return Session(study, load) if study.synthesis is None else TaskSession(study, load)


class TaskSession(ServedStudy):
    """What the pages of one task ask.

    Changes are entries of the task, as `--set` names them. A search is dropped as soon as a newer change comes, and a
    linkage that is taken over has a session of its own, as of a study that is not yet saved.
    """

    def _take(self, study: Study) -> None:
        if study.synthesis is None:
            raise StudyError("the study has no task any more: start mechdesign live again for its mechanism")
        self.study, self._searches = study, dict[str, Result]()
        if study.is_task:
            self.linkages.pop(_OWN, None)
        elif _OWN in self.linkages:
            self.linkages[_OWN].reload()
        else:
            self.linkages[_OWN] = Session(study, self._load)
            self.linkages[_OWN].taken = True

    @property
    def actions(self) -> Actions:
        """What a page may ask, by the words of its requests."""
        return {"answer": self.answer, "take": self.take, "save": self.save}

    def page(self) -> bytes:
        """The page of the task as it is in the file; its linkages come when they are found."""
        study = self.study
        sheet, drawing = _drawing(study)
        handles = _handles(study)
        assert study.synthesis is not None
        task = task_of(study, study.synthesis)
        about = {
            "version": self.version, "questions": [_QUESTION], "length": study.units.label("length"),
            **file_names(study), "mistake": self.mistake, "handles": handles, "turn": study.units.angle_factor,
            "sheet": [sheet.corner.real, sheet.corner.imag, sheet.scale] if sheet else None,
            "step": float(f"{task.size / 100:.1g}"),
        }  # fmt: skip
        return rendered(
            "task.html.j2", package=PACKAGE, parts=("moving", "hand", "task"), connect="'self'",
            drawings=[drawing], study=study, about=about, groups=[*_groups(study, handles, task.size)],
            question=COMMANDS[_QUESTION].question, name=_QUESTION, mistake=self.mistake, drawing=drawing,
            words=[*task_in_words(study)], own=f"linkage/{_OWN}/" if _OWN in self.linkages else "",
        )  # fmt: skip

    @np.errstate(all="ignore")
    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The linkages of the changed task, moving side by side; of a task without any the one that comes nearest.

        Raises
        ------
        OvertakenError
            If the page has asked something newer.
        """
        changes = changes_of(request)
        key = repr(sorted(changes.items()))
        with self._watched(request) as (_, progress):
            study = altered(self.study, changes)
            result = self._search(study, key, progress)
            progress.look()
            with DRAWING, style.context("paper"):
                part = solutions(study, result, f"{_QUESTION}-trade")
        content: dict[str, Any] = {"part": None, "name": _QUESTION, "result": result}
        choices, drawn = list[dict[str, Any]](), list[str]()
        if part is not None:
            choices = part.data["choices"]
            count = f"{len(choices)} of {counted(len(result.main), 'linkage')} drawn."
            content["part"] = dataclasses.asdict(dataclasses.replace(part, data={**part.data, "pace": count}))
            drawn = [*(choice["drawing"] for choice in choices), part.beside]
        rows, texts = [choice["number"] - 1 for choice in choices], [text for _, text in _files(result)]
        return {
            "set": overrides(self.study, study), "search": key, "dark": dark(drawn),
            "tiles": [[row, f"linkage/{_name(texts[row])}/"] for row in rows],
            "words": [*task_in_words(study)], "stage": fragment("task_stage.html.j2", PACKAGE, **content),
            "html": fragment("linkages.html.j2", PACKAGE, **content),
        }  # fmt: skip

    def _search(self, study: Study, key: str, progress: Progress) -> Result:
        """The linkages of a task; those of the newest tasks are kept."""
        if (result := self._searches.get(key)) is None:
            try:
                result = ask(study, _QUESTION, progress=progress)
            except AssemblyError as error:
                if error.result is None:
                    raise
                result = error.result
            self._searches = dict([*self._searches.items(), (key, result)][-_MOST_ANSWERS:])
        return result

    def take(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Take over a linkage of a search: the address of its page, in which it is dragged and saved."""
        key, row = str(request.get("search")), number_of(request.get("row"))
        result = self._searches.get(key)
        if result is None:
            raise StudyError("that search is over; change a point, or load the page again, and it is made anew")
        drawn = DrawnSolutions.of(result)
        if row not in range(len(drawn.data)):
            raise RequestError
        file, text = _files(result)[int(row)]
        name = _name(text)
        if name not in self.linkages:
            study = drawn.linkage(int(row))
            path = study.folder.path / f"{self.study.label.rpartition('/')[2]}_{file}"
            self.linkages[name] = Session(dataclasses.replace(study, path=path, text=text.encode()))
            self.linkages[name].taken = True
            taken = [other for other in self.linkages if other != _OWN]
            for other in taken[:-_MOST_LINKAGES]:
                self.linkages.pop(other).ended = True
        return {"to": f"linkage/{name}/"}


def _files(result: Result) -> list[tuple[str, str]]:
    """Names and texts of the studies of the solutions, best first, without the files that these read."""
    return [(name, text) for name, text in result.files.items() if name.startswith(("solution_", "nearest"))]


def _name(text: str) -> str:
    """What a linkage is called in its address: the same whenever a search finds it, so that its page keeps changes."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _drawing(study: Study) -> tuple[Canvas | None, str]:
    """The task alone, as it stands until linkages are found; nothing of a function."""
    assert study.synthesis is not None
    task = task_of(study, study.synthesis)
    if not len(task.points):
        return None, ""
    corners = [complex(x, y) for box in study.synthesis.keep_out for x in box.x for y in box.y]
    sheet = Canvas.around(np.concatenate([task.points, corners]))
    root = sheet.root("the task")
    mark_task(root, sheet, study.synthesis, task.points, task.directions)
    return sheet, tostring(root, encoding="unicode")


def _handles(study: Study) -> list[dict[str, Any]]:
    """Points and positions of the task that a hand may drag, with the names of their entries and their values."""
    section = study.synthesis
    assert section is not None
    if section.body is not None:
        keys: tuple[Any, ...] = ("x", "y", "angle")
        what, where = "position", f"{TASK}.body"
        rows: list[tuple[float, ...]] = [(part.x, part.y, part.angle) for part in section.body]
    else:
        keys, what, where, rows = (0, 1), "point", POINTS, [*map(tuple, path_points(study))]
    if len(rows) > _MOST_HANDLES:
        return []
    return [
        {"label": f"{what} {k + 1}", "names": [f"{where}.{k}.{key}" for key in keys], "values": [*map(float, row)]}
        for k, row in enumerate(rows)
    ]


def _groups(study: Study, handles: list[dict[str, Any]], size: float) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Numbers of the task that can be changed, by its points, positions or pairs."""
    section, length, angle = study.synthesis, study.units.label("length"), study.units.label("angle")
    assert section is not None
    reaches = {length: _REACH * size, angle: math.radians(_TURN) / study.units.angle_factor}
    if section.function is not None:
        units = angle, angle if section.output_kind == FOUR_BAR else length
        for k, pair in enumerate(zip(section.function.input, section.function.output, strict=True)):
            yield f"pair {k + 1}", [
                number_field(f"{TASK}.function.{key}.{k}", f"{key} {k + 1}", value, unit, reaches[unit])
                for key, value, unit in zip(("input", "output"), pair, units, strict=True)
            ]  # fmt: skip
    for key, kind in _CONDITIONS.items():
        unit, written = study.units.label(kind), leaves({key: plain(study.resolved[TASK]).get(key, {})})
        # What is written with its unit, or follows a parameter, stays text.
        limits = {dotted(keys): float(value) for keys, value in written if isinstance(value, int | float)}
        if limits:
            yield key, [number_field(f"{TASK}.{name}", name, value, unit, reaches[unit])
                        for name, value in limits.items()]  # fmt: skip
    for handle in handles:
        numbers = zip(handle["names"], handle["values"], ("x", "y", "angle"), (length, length, angle), strict=False)
        label = handle["label"]
        yield label, [number_field(name, f"{label}, {key}", value, unit, reaches[unit])
                      for name, value, key, unit in numbers]  # fmt: skip

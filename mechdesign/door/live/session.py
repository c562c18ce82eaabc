"""A mechanism that is changed by hand: what its page asks of the engine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.commands import QUESTIONS
from mechdesign.door.live import saving
from mechdesign.door.live.altered import SKETCH, altered, free_numbers, is_entry, value_of
from mechdesign.door.live.answers import AS_IT_WAS, PACKAGE, ChangedAnswer, staged, titled
from mechdesign.door.live.assembly import next_assembly
from mechdesign.door.live.drag import TURNED, Drag, Dragged, dragged
from mechdesign.door.live.fields import number_field
from mechdesign.door.live.requests import RequestError, changes_of, number_of, numbers_of, sheet_of, texts_of
from mechdesign.door.live.served import Actions, OvertakenError, ServedStudy
from mechdesign.door.live.turned import motion_of, turning
from mechdesign.door.report.page.dark import dark
from mechdesign.door.report.page.headlines import shown
from mechdesign.door.report.page.linkage import Canvas
from mechdesign.door.report.page.moving import moving, posed
from mechdesign.door.report.page.template import fragment, rendered
from mechdesign.door.report.page.tracks import ROWS, steps
from mechdesign.drawing.before import Before
from mechdesign.ground.errors import MechdesignError, StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.progress import Progress
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.look import ask
from mechdesign.study import Study

# In the order in which they are asked first, and those that make designs of their own, which are asked last.
_ORDER, _LONG = (
    ("kinematics", "stiffness", "dynamics", "workspace", "reliability"),
    ("sensitivities", "sweep", "optimize"),
)
_MOST_ROWS = 20_000  # poses that a page draws
_ALIKE = 1e-9  # lengths and angles that differ by less are the same
_PIXEL = 0.1  # of a drawing, by which a dragged number is rounded
_REACH = 0.6  # of a slider to both sides, as a part of the number
_WAY = 0.3  # of a slider of a number that is zero, as a part of the mechanism's size


class Session(ServedStudy):
    """What the pages of one mechanism ask."""

    def __init__(self, study: Study, load: Callable[[], Study] | None = None) -> None:
        super().__init__(study, load)
        self._seconds = dict[str, float]()  # that each question took last

    @np.errstate(all="ignore")
    def _take(self, study: Study) -> None:
        """The study of the file from now on, and how it moves."""
        study.need_mechanism("live")
        shown, held = study, dict[str, str]()
        try:
            first = motion_of(study)
        except MechdesignError:
            first = None
        if first is None:
            shown, held = turning(study)
            first = motion_of(shown)
        if first is None:
            raise StudyError("the study has no motion that can be shown")
        self.study, self.shown, self.held, self._first = study, shown, held, first

    @property
    def actions(self) -> Actions:
        """What a page may ask, by the words of its requests."""
        return {"move": self.move, "answer": self.answer, "pictures": self.pictures, "save": self.save,
                "assembly": self.assembly}  # fmt: skip

    @np.errstate(all="ignore")
    def page(self) -> bytes:
        """The page of the study as it is in the file."""
        study, part = self.study, moving(self.shown, self._first, handled=True)
        assert part is not None
        questions, points = self._questions(), self._handles()
        about = {
            "version": self.version, "questions": self._quickest(), "long": _LONG,
            "length": study.units.label("length"), **saving.file_names(study), "points": points,
            "pivots": [point for point in points if GROUND in study.mechanism.graph.links_at(point)],
            "step": float(f"{study.mechanism.size / 100:.1g}"), "mistake": self.mistake, "entries": self._entries(),
        }  # fmt: skip
        return rendered(
            "live.html.j2", package=PACKAGE, parts=("moving", "hand", "live"), connect="'self'",
            drawings=[part.drawing], study=study, part=part, about=about, groups=self._groups(), taken=self.taken,
            questions={name: QUESTIONS[name].question for name in questions}, mistake=self.mistake,
        )  # fmt: skip

    def _entries(self) -> dict[str, float]:
        """Numbers of the sketch that a hand may change, by the names of their entries."""
        points = self.study.resolved["mechanism"].get("sketch") or {}
        names = [f"{SKETCH}.{point}.{axis}" for point in points for axis in (0, 1)]
        return {name: value_of(self.study, name) for name in names}

    def _questions(self) -> list[str]:
        sections, names = self.study.sections, (*_ORDER, *_LONG)
        return [name for name in names if name == "kinematics" or sections.get(QUESTIONS[name].key) is not None]

    def _quickest(self) -> list[str]:
        """The questions by the time that each took last; then those that were not asked yet."""
        return sorted(self._questions(), key=lambda name: self._seconds.get(name, math.inf))

    def _handles(self) -> list[str]:
        """Points that a number of the study may move."""
        owners = {place.path[1] for name, place in self.study.mechanism.description.places.items()
                  if place.path[:1] == ("links",)}  # fmt: skip
        graph = self.study.mechanism.graph
        return [point for point in self.study.mechanism.points if owners.intersection(graph.links_at(point))]

    def _groups(self) -> list[tuple[str, list[dict[str, Any]]]]:
        """Numbers that can be changed, by parameters and parts of the mechanism."""
        groups: dict[str, list[dict[str, Any]]] = {}
        study = self.shown
        for name in free_numbers(study):
            value, place = value_of(study, name), study.mechanism.description.places.get(name)
            owner = "parameters" if place is None else str(place.path[1] if len(place.path) > 1 else place.path[0])
            owner = "drives that stand still" if name in self.held else owner
            reach = _REACH * abs(value)
            if reach == 0.0:
                lengths = self._unit(name) != study.units.label("angle")
                reach = _WAY * study.mechanism.size if lengths else 180.0
            least = -math.inf if place is None or place.least is None else 0.0
            field = number_field(name, self.held.get(name, name), value, self._unit(name), reach, least=least,
                                 whole=name in study.fixed)  # fmt: skip
            groups.setdefault(owner, []).append(field)
        return sorted(groups.items(), key=lambda group: (group[0] != "parameters", group[0] != GROUND))

    @np.errstate(all="ignore")
    def move(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Positions with changed numbers, or with those that a drag changes; with ``wrong`` where there are none."""
        changes, sheet = changes_of(request), sheet_of(request, self.shown.mechanism.size)
        self._page(request)
        drag, rows = self._drag(request.get("drag"), sheet), _rows(request)
        done = Dragged(changes, 0.0) if drag is None else dragged(self.shown, changes, drag)
        now = altered(self.shown, done.changes)
        own = now if self.shown is self.study else altered(self.study, self._own(done.changes))
        drawing, tracks = posed(now, rows, sheet, self.shown)
        return {
            "changes": dict(done.changes), "names": done.names, "why": done.why, "row": done.row, "hint": done.hint,
            "drawing": drawing, "data": titled(tracks), "missing": _missing(rows, tracks["gaps"]),
            "set": saving.overrides(self.study, own), "words": [*self._words(done, now)],
        }  # fmt: skip

    def _drag(self, drag: Any, sheet: Canvas) -> Drag | None:
        """What a hand holds in a drawing; None where it holds nothing."""
        if drag is None:
            return None
        if not isinstance(drag, Mapping):
            raise RequestError
        hand = Drag(
            str(drag.get("point")), complex(*numbers_of(drag.get("to"), 2)), number_of(drag.get("row")),
            texts_of(drag.get("locked")), texts_of(drag.get("held")), _PIXEL / sheet.scale,
            number_of(drag.get("near", 0)) / sheet.scale,
        )  # fmt: skip
        numbers = {TURNED, *self.shown.parameters.names(), *self._entries()}
        if hand.point not in self.shown.mechanism.points or not numbers.issuperset(hand.held):
            raise RequestError
        return hand

    def _words(self, done: Dragged, now: Study) -> Iterator[str]:
        """What a drag has changed, in words: its numbers, and what is measured in a sketch that it has moved."""
        drawn = {*filter(is_entry, done.names)}
        if drawn:
            before = altered(self.shown, {name: value for name, value in done.changes.items() if name not in drawn})
        for name in (*done.names, *(free_numbers(self.shown) if drawn else ())):
            moved = name in done.names or not math.isclose(now.sizes[name], before.sizes[name], abs_tol=_ALIKE)
            if name != TURNED and moved:
                yield self._in_words(now, name)

    @np.errstate(all="ignore")
    def assembly(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Changes by which the sketch shows the next assembly, and its name."""
        changes, words = next_assembly(self.shown, changes_of(request))
        return {"changes": changes, "words": words}

    def _in_words(self, study: Study, name: str) -> str:
        label = name.removeprefix("mechanism.")
        return f"{label} = {shown(value_of(study, name))} {self._unit(name)}".rstrip()

    def _unit(self, name: str) -> str:
        if is_entry(name):
            return self.study.units.label("length")
        return self.shown.unit_of(self.held.get(name, name)) or ""

    @np.errstate(all="ignore")
    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a question with changed numbers, and the order in which questions are asked next.

        Raises
        ------
        OvertakenError
            If the page has asked something newer.
        """
        changes, question = changes_of(request), request.get("question")
        if question not in self._questions():
            raise RequestError
        sheet = sheet_of(request, self.shown.mechanism.size) if request.get("sheet") else None
        with self._watched(request) as (page, progress):
            begin = time.perf_counter()
            answer = page.answers[question] = self._ask(question, changes, progress)
            progress.look()
            first = Before(self.shown, self._first.seen, ("", AS_IT_WAS)) if changes else None
            if part := answer.part(first if question == "kinematics" else None, sheet):
                page.parts[question] = part
            stage = staged(page.parts)
            html = answer.html(stage)
            self._seconds[question] = time.perf_counter() - begin
        moved = _drawn(stage) if part and stage else {}
        return {"set": saving.overrides(self.study, answer.study), "html": html, "order": self._quickest(), **moved}

    def _ask(self, question: str, changes: Mapping[str, float], progress: Progress) -> ChangedAnswer:
        """What the study with changed numbers answers, and how the study that is shown moves with them."""
        study = moves = altered(self.study, self._own(changes))
        result = motion = None
        if question != "kinematics" or study.kinematics is not None or self.shown is self.study:
            result = motion = ask(study, question, progress=progress)
        if question == "kinematics" and self.shown is not self.study:
            moves = altered(self.shown, changes)
            motion = ask(moves, question, progress=progress)
        assert motion is not None
        return ChangedAnswer(question, study, result, moves, motion)

    @np.errstate(all="ignore")
    def pictures(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The first pictures of the last answer to a question, as they stand in a report.

        Raises
        ------
        OvertakenError
            If the page has asked something newer.
        """
        page, progress = self._turn(request)
        progress.look()
        answer = page.answers.get(str(request.get("question")))
        if answer is None:
            raise OvertakenError
        drawn = answer.pictures(progress.look)
        html = fragment("pictures.html.j2", PACKAGE, pictures=drawn)
        return {"html": html, "dark": dark(drawn.values())}


def _rows(request: Mapping[str, Any]) -> Floats:
    """The poses of the motion that a page draws."""
    count = int(number_of(request.get("poses")))
    if not 0 < count <= _MOST_ROWS:
        raise RequestError
    return steps(str(request.get("rows")), count) / ROWS


def _missing(rows: Floats, gaps: Sequence[tuple[int, int, str]]) -> str:
    """Where a motion cannot be assembled, in words: by the poses of its table, not by all that are drawn."""
    if not gaps:
        return ""
    poses = rows == np.rint(rows)
    lost = sum(int(poses[first : end + 1].sum()) for first, end, _ in gaps)
    share = f"{lost} of {int(poses.sum())} poses" if lost else "between two poses"
    return f"{share}: {gaps[0][2].removesuffix(' here')}"


def _drawn(stage: Mapping[str, Any]) -> dict[str, Any]:
    """A mechanism that moves as its page takes it: tracks, drawing, its colours on a dark screen, numbers."""
    drawing = stage["drawing"]
    return {"data": stage["data"], "drawing": drawing, "dark": dark([drawing]),
            "numbers": fragment("numbers.html.j2", PACKAGE, part=stage)}  # fmt: skip

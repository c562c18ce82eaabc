"""A study that is changed by hand: what its page asks of the engine, and what it may write."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from mechdesign.commands import COMMANDS
from mechdesign.door.live.drag import Drag, dragged, free_numbers, value_of
from mechdesign.door.report.page.dark import dark
from mechdesign.door.report.page.headlines import headlines, shown
from mechdesign.door.report.page.linkage import Canvas
from mechdesign.door.report.page.moving import moving, posed
from mechdesign.door.report.page.page import AnsweredQuestion, mover, pose_of, required_of
from mechdesign.door.report.page.template import fragment, rendered
from mechdesign.door.report.page.tracks import ROWS, joined, steps
from mechdesign.door.report.requirements import requirements
from mechdesign.drawing.before import Before
from mechdesign.ground.errors import MechdesignError, StudyError, explain
from mechdesign.ground.files import flowing, proper, replace
from mechdesign.ground.progress import Progress
from mechdesign.ground.results import Result
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.loading import load_bytes
from mechdesign.study.text.document import dotted, in_yaml, leaves, plain
from mechdesign.study.variants import changed_data, edited, in_text

PACKAGE = "mechdesign.door.live"
# Questions about one design, in the order in which they are asked first; the others make designs of their own.
QUESTIONS = ("kinematics", "stiffness", "dynamics", "workspace", "reliability")
_AS_IT_WAS = "As it was"
_LARGEST = 1e150  # number that a page may send
_MOST_ROWS = 20_000  # poses that a page draws
_PIXEL = 0.1  # of a drawing, by which a dragged number is rounded
_REACH = 0.6  # of a slider to both sides, as a part of the number
_WAY = 0.3  # of a slider of a number that is zero, as a part of the mechanism's size
_STEPS = 400  # of a slider
_MOST_DEAD = 12  # dead centres that are listed


class OvertakenError(Exception):
    """A newer change of the same page made an answer worthless."""


class AskedError(Exception):
    """A request that no page makes."""


class _Watched(Progress):
    """Progress that ends a computation which was overtaken, and tells how far it is."""

    def __init__(self, overtaken: Callable[[], bool], tell: Callable[[str], None]) -> None:
        self._overtaken, self._tell, self._stage, self._done, self._total = overtaken, tell, "", 0, 0

    def start(self, total: int, stage: str) -> None:
        """Begin a stage."""
        self._stage, self._done, self._total = stage, 0, total
        self.update(0)

    def update(self, n: int) -> None:
        """Go on, unless it was overtaken."""
        self._done += n
        self._tell(f"{self._stage} {100 * self._done // max(self._total, 1)} %")
        if self._overtaken():
            raise OvertakenError


class Session:
    """What the pages of one study ask.

    Every request says by what its page differs from the study (`changes`, by the names of parameters and dimensions, in
    the study's units): the study in memory is that of the file, and nothing of a page is kept but what a computation
    needs to be dropped.

    Attributes
    ----------
    version : int
        Counts changes of the file; a page of an older version is made anew.
    mistake : str
        What is wrong with the file since it was last right; empty where it is.
    """

    def __init__(self, study: Study, load: Callable[[], Study] | None = None) -> None:
        self.study, self._load = study, load
        self.version, self.mistake = 1, ""
        self.changed = threading.Condition()
        self._computing, self._turns, self._progress = threading.Lock(), dict[str, int](), dict[str, str]()
        self._parts: dict[str, Any] = {}
        self._first: tuple[int, Result] | None = None

    def reload(self) -> None:
        """Read the file again; where it has mistakes the last study without any stays."""
        assert self._load is not None
        with self.changed:
            try:
                self.study, self.mistake = self._load(), ""
            except MechdesignError as error:
                self.mistake = explain(error)[1]
            self.version += 1
            self.changed.notify_all()

    @np.errstate(all="ignore")
    def page(self) -> bytes:
        """The page of the study as it is in the file."""
        study = self.study
        part = moving(study, self._as_it_was(), handled=True)
        if part is None:
            raise StudyError("the study has no motion that can be shown: give its kinematics a sweep or a path")
        data = dict(part.data)
        questions = self._questions()
        about = {
            "version": self.version, "questions": questions, "length": study.units.label("length"),
            "file": study.path.name if study.path is not None else "", "points": self._handles(),
            "step": float(f"{study.mechanism.size / 100:.1g}"), "mistake": self.mistake,
        }  # fmt: skip
        return rendered(
            "live.html.j2", package=PACKAGE, parts=("moving", "live"), connect="'self'", drawings=[part.drawing],
            study=study, part=dataclasses.replace(part, data=data), about=about, groups=self._groups(),
            questions={name: COMMANDS[name].question for name in questions}, mistake=self.mistake,
        )  # fmt: skip

    def _questions(self) -> list[str]:
        return [name for name in QUESTIONS if name == "kinematics" or name in self.study.questions]

    def _handles(self) -> list[str]:
        """Points that a number of the study may move."""
        owners = {place.path[1] for name, place in self.study.mechanism.description.places.items()
                  if place.path[:1] == ("links",)}  # fmt: skip
        graph = self.study.mechanism.graph
        return [point for point in self.study.mechanism.points if owners.intersection(graph.links_at(point))]

    def _groups(self) -> list[tuple[str, list[dict[str, Any]]]]:
        """Numbers that can be changed, by parameters and parts of the mechanism."""
        groups: dict[str, list[dict[str, Any]]] = {}
        study = self.study
        for name in free_numbers(study):
            value, place = value_of(study, name), study.mechanism.description.places.get(name)
            owner = "parameters" if place is None else str(place.path[1] if len(place.path) > 1 else place.path[0])
            reach = _REACH * abs(value)
            if reach == 0.0:
                lengths = place is None or place.quantity != "angle"
                reach = _WAY * study.mechanism.size if lengths else 180.0
            low = value - reach if place is None or place.least is None else max(value - reach, 0.0)
            step = 1.0 if name in study.fixed else 10.0 ** math.floor(math.log10(2 * reach / _STEPS))
            groups.setdefault(owner, []).append({
                "name": name, "value": value, "unit": study.unit_of(name) or "", "low": low, "high": value + reach,
                "step": step,
            })  # fmt: skip
        return sorted(groups.items(), key=lambda group: (group[0] != "parameters", group[0] != GROUND))

    def _as_it_was(self) -> Result:
        """The motion of the study in the file."""
        if self._first is None or self._first[0] != self.version:
            with self._computing:
                self._first = self.version, import_module(COMMANDS["kinematics"].module).kinematics(self.study)
        return self._first[1]

    @np.errstate(all="ignore")
    def move(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Positions with changed numbers, or with those that a drag changes; with ``wrong`` where there are none."""
        study, changes, sheet = self.study, _changes(asked), _sheet(asked)
        self._turn(asked)
        names: tuple[str, ...] = ()
        why = ""
        if (drag := asked.get("drag")) is not None:
            if not isinstance(drag, Mapping):
                raise AskedError
            hand = Drag(
                str(drag.get("point")), complex(*_numbers(drag.get("to"), 2)), _number(drag.get("row")),
                _texts(drag.get("locked")), _texts(drag.get("held")), _PIXEL / sheet.scale,
            )  # fmt: skip
            if hand.point not in study.mechanism.points:
                raise AskedError
            done = dragged(study, changes, hand)
            changes, names, why = dict(done.changes), done.names, done.why
        count = int(_number(asked.get("poses")))
        if not 0 < count <= _MOST_ROWS:
            raise AskedError
        now = variant(study, changes)
        drawing, tracks = posed(now, steps(str(asked.get("rows")), count) / ROWS, sheet, study)
        if "before" in tracks:
            tracks["before"]["title"] = _AS_IT_WAS
        return {"changes": changes, "names": names, "why": why, "drawing": drawing, "data": tracks,
                "set": self.overrides(changes), "words": [self._in_words(now, name) for name in names]}  # fmt: skip

    def _in_words(self, study: Study, name: str) -> str:
        return f"{name} = {shown(value_of(study, name))} {self.study.unit_of(name) or ''}".rstrip()

    @np.errstate(all="ignore")
    def answer(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a question with changed numbers.

        Raises
        ------
        OvertakenError
            If the page has asked something newer.
        """
        changes, question = _changes(asked), asked.get("question")
        if question not in self._questions():
            raise AskedError
        page, turn = self._turn(asked)

        def overtaken() -> bool:
            return self._turns.get(page) != turn

        with self._computing:
            if overtaken():
                raise OvertakenError
            progress = _Watched(overtaken, partial(self._progress.__setitem__, page))
            try:
                return self._answered(question, changes, asked, progress)
            finally:
                self._progress.pop(page, None)

    def _answered(
        self, question: str, changes: Mapping[str, float], asked: Mapping[str, Any], progress: Progress
    ) -> dict[str, Any]:
        study = variant(self.study, changes)
        result: Result = getattr(import_module(COMMANDS[question].module), question)(study, progress=progress)
        verdicts = requirements(study, result)
        numbers = headlines(result.seen)
        answered: dict[str, Any] = {"set": self.overrides(changes)}
        key, part = repr((self.version, sorted(changes.items()), asked.get("sheet"))), None
        if question in ("kinematics", "dynamics"):
            before = None
            if question == "kinematics" and changes and (first := self._first) is not None:
                before = Before(self.study, first[1].seen, ("", _AS_IT_WAS))
            sheet = _sheet(asked) if asked.get("sheet") else None
            marked = [number.place for number in numbers if number.place is not None]
            part = moving(study, result.seen, before, marked, plain=sheet is not None, sheet=sheet, handled=True)
        if part is not None:
            whole = dataclasses.asdict(part)
            whole["data"] = dict(whole["data"])
            if "before" in whole["data"]:
                whole["data"]["before"]["title"] = _AS_IT_WAS
            if question == "kinematics":
                self._parts = {"key": key, "part": whole}
            elif self._parts.get("key") == key and whole["data"]["course"] == self._parts["part"]["data"]["course"]:
                whole = joined(self._parts["part"], whole)
            else:
                whole = {}
            if whole:
                answered |= {"data": whole["data"], "drawing": whole["drawing"], "dark": dark([whole["drawing"]])}
                answered["numbers"] = fragment("numbers.html.j2", PACKAGE, part=whole)
        section = AnsweredQuestion(question, "", 0, verdicts=verdicts)
        moves = {"kinematics": self._parts["part"]} if self._parts.get("key") == key else {}
        own = [entry for entry in required_of(study, [section]) if entry["verdict"] is not None]
        answered["html"] = fragment(
            "answer.html.j2", PACKAGE, command=question, question=COMMANDS[question].question, numbers=numbers,
            required=own, mover=partial(mover, moves), pose_of=pose_of, failed=result.failed,
            warnings=[*map(str, result.warnings)], dead=_dead_centres(result),
        )  # fmt: skip
        return answered

    def overrides(self, changes: Mapping[str, float]) -> list[str]:
        """Changes as `--set` takes them, by the entries of the study."""
        now = dict(leaves(plain(self.study.resolved)))
        changed = leaves(changed_data(self.study, changes))
        return [f"{dotted(keys)}={in_yaml(value)}" for keys, value in changed if keys not in now or now[keys] != value]

    @np.errstate(all="ignore")
    def save(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Write the study with changed numbers into its file, or into another in its folder.

        A file that is there is replaced only where the page says so; ``exists`` asks for it.
        """
        study, changes = self.study, _changes(asked)
        if study.path is None:
            raise StudyError("the study is no file; copy the changes as --set")
        name = str(asked.get("name") or study.path.name)
        path = study.path.parent / name
        if not proper(name) or "\\" in name or name.startswith(".") or path.suffix not in (".yaml", ".yml"):
            raise StudyError(f"{name!r} is no plain name of a file that ends in .yaml")
        own = path == study.path
        if own and path.read_bytes() != study.text:
            raise StudyError(f"{name} was changed since it was read here; nothing was written")
        if flowing(path) or (path.is_symlink() and not own) or path.is_dir():
            raise StudyError(f"{name} is no file that may be replaced")
        if path.exists() and not asked.get("replace"):
            return {"exists": name}
        data = changed_data(study, changes)
        text = in_text(study, data)
        again = load_bytes(text.encode(), path, (), None, study.folder)
        if any(not math.isclose(value, again.sizes[key], rel_tol=1e-12, abs_tol=1e-300)
               for key, value in variant(study, changes).sizes.items()):  # fmt: skip
            raise StudyError("the changed study could not be written so that it reads the same; nothing was written")
        replace(path, [text.encode()])
        return {"saved": name, "comments": edited(study, data) is not None}

    def progress(self, page: str) -> str:
        """How far the computation for a page is, in words."""
        return self._progress.get(page, "")

    def _turn(self, asked: Mapping[str, Any]) -> tuple[str, int]:
        """The page and the number of its request; older computations for it are overtaken."""
        page, turn = str(asked.get("page"))[:40], int(_number(asked.get("turn")))
        if len(self._turns) > 1000:
            self._turns.clear()
        self._turns[page] = max(turn, self._turns.get(page, 0))
        return page, turn


def _dead_centres(result: Result) -> list[dict[str, Any]]:
    """Poses of a motion at which it cannot go on, and where links come into line, in words and by what is given."""
    listed: list[dict[str, Any]] = []
    given = DrawnMotion.of(result).shown.poses.values if result.command == "kinematics" else {}
    words = {"limits": ("kind", "joint"), "toggles": ("links", "state", "effect")}
    for table in (result.tables[name] for name in words if name in result.tables):
        for row in range(min(len(table), _MOST_DEAD)):
            pose = {name: float(table[name][row]) for name in given if name in table}
            said = ", ".join(text for name in words[table.name] if (text := str(table[name][row])))
            at = ", ".join(
                f"{name} = {shown(value)} {table.column(name).unit}".rstrip() for name, value in pose.items()
            )
            if pose:
                listed.append({"words": said, "at": at, "pose": pose})
    return listed


def _changes(asked: Mapping[str, Any]) -> dict[str, float]:
    changes = asked.get("changes")
    if not isinstance(changes, Mapping):
        raise AskedError
    return {str(name): _number(value) for name, value in changes.items()}


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _LARGEST:
        raise AskedError
    return float(value)


def _numbers(values: Any, count: int) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise AskedError
    return [*map(_number, values)]


def _texts(values: Any) -> list[str]:
    if values is not None and not isinstance(values, list):
        raise AskedError
    return [str(value) for value in values or ()]


def _sheet(asked: Mapping[str, Any]) -> Canvas:
    x, y, scale, width, height = _numbers(asked.get("sheet"), 5)
    if min(scale, width, height) <= 0:
        raise AskedError
    return Canvas(complex(x, y), scale, width, height)

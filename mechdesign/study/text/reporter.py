"""Mistakes of a study, each with the place in the text where it stands."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

from pydantic import Tag, ValidationError
from pydantic.fields import FieldInfo

from mechdesign.ground.errors import Problem, StudyError, nearest, suggestion
from mechdesign.study.text.document import Document, KeyPath, dotted, has, leaves, plain
from mechdesign.study.text.fields import Model
from mechdesign.study.text.reading import LOST, MAX_NAMED, shown
from mechdesign.study.text.units import QuantityError, measure, text_of

# Expected values by the types of pydantic's errors.
_EXPECTED = defaultdict(
    lambda: "something else",
    string_type="a text",
    dict_type="a mapping of names",
    model_type="a mapping",
    model_attributes_type="a mapping",
    tuple_type="a list",
    list_type="a list",
    bool_type="true or false",
    bool_parsing="true or false",
    too_long="a shorter list",
    none_required="nothing",
)
# Types of errors where a mapping is expected.
_MAPPINGS = ("dict_type", "model_type", "model_attributes_type")


# Keys that are written in place of others.
_SYNONYMS = {"min": "from", "max": "to", "from": "min", "to": "max"}
# What no section takes, with where it is asked or why it is not.
_ELSEWHERE = {
    **dict.fromkeys(("spherical", "ball", "universal", "cylindrical", "helical"), "planar mechanisms only"),
    **dict.fromkeys(("clearance", "clearances", "play", "backlash"), "play is asked under reliability: clearances"),
}


def unknown_key(name: str, names: Iterable[str]) -> str:
    """Message of an unknown key, with the key that is meant the same or is most similar, or where it is asked."""
    candidates = [*names]
    meant = _SYNONYMS.get(name)
    hint = suggestion(meant if meant in candidates else name, candidates)
    elsewhere = f"; {_ELSEWHERE[name]}" if name in _ELSEWHERE else ""
    return f"unknown key{hint or elsewhere}"


class PathRemark(NamedTuple):
    """A message about a path of the data, which stands at the key there or else at its value."""

    path: tuple[str | int, ...]
    message: str
    at_key: bool


class Reporter:
    """Collects mistakes of one document, finds their places in the text, and raises them together."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._mistakes: list[PathRemark] = []
        self._doubts: list[PathRemark] = []
        self.kinds: dict[KeyPath, str] = {}

    @property
    def problems(self) -> list[Problem]:
        """Mistakes so far, in the order in which they were found, each once."""
        placed = [problem for mistake in self._mistakes for problem in self._placed(mistake)]
        return list(dict.fromkeys([*self.document.problems, *placed]))

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """What is likely a mistake."""
        return tuple(problem for doubt in self._doubts for problem in self._placed(doubt))

    def check_name(
        self, name: str, names: Iterable[str], noun: str, path: Iterable[str | int], *, at_key: bool = False
    ) -> bool:
        """Whether a name is among the names; if not, report it with the most similar of them."""
        candidates = list(names)
        if name in candidates:
            return True
        hint = suggestion(name, candidates)
        if candidates and not hint:
            hint = f"; there are {', '.join(candidates[:MAX_NAMED])}"
        self.report(tuple(path), f"there is no {noun} {name!r}{hint}", at_key=at_key)
        return False

    def report(self, path: Sequence[str | int], message: str, *, at_key: bool = False) -> None:
        """Report a mistake at a path of the data, which may go through the long form of a short one."""
        self._mistakes.append(PathRemark(tuple(path), message, at_key))

    def kind(self, path: KeyPath, kind: str) -> None:
        """Report quantities at or below a path of the data whose unit is of another kind."""
        self.kinds[path] = kind
        for keys, raw in leaves(self.document.raw(path)):
            # The unit of a parameter is checked with the parameter.
            parameter = self.document.raw(("mechanism", "parameters", raw)) if isinstance(raw, str) else None
            if text := text_of(raw) or text_of(parameter):
                try:
                    measure(text, kind)
                except QuantityError as error:
                    self.report((*path, *keys), str(error))

    def unused(self, path: KeyPath, noun: str, others: Iterable[str]) -> None:
        """Warn of a name that nothing uses; if an override added it, report it as misspelt."""
        name = path[-1]
        if path in self.document.added:
            hint = suggestion(str(name), others)
            self.report(path, f"the study has no {noun} {name!r}, and nothing uses one{hint}", at_key=True)
        else:
            self.doubt(path, f"nothing uses {noun} {name!r}", at_key=True)

    def doubt(self, path: Sequence[str | int], message: str, *, at_key: bool = False) -> None:
        """Warn of what is likely a mistake at a path of the data."""
        self._doubts.append(PathRemark(tuple(path), message, at_key))

    def _placed(self, remark: PathRemark) -> Iterator[Problem]:
        """A remark at its place in the text; nothing where it only follows from a mistake of the text itself."""
        written = self.document.written(remark.path)
        above = [written[:length] for length in range(len(written) + 1)]
        if not self.document.spoiled.isdisjoint(above):
            return
        comma = next((self.document.commas[part] for part in above if part in self.document.commas), None)
        hint = f"; a decimal is written with a point: {comma}" if comma is not None else ""
        there = next(part for part in reversed(above) if part in self.document.values)
        mark = self.document.values[there]
        if (remark.at_key or there != written) and there in self.document.keys:
            mark = self.document.keys[there]
        yield mark.problem(remark.message + hint, dotted(written))

    def done(self) -> None:
        """Raise all problems, in the order of the text.

        Raises
        ------
        StudyError
            If there are any.
        """
        if problems := self.problems:
            ordered = sorted(problems, key=lambda problem: (problem.line == 0, problem.line, problem.column))
            raise StudyError(ordered)

    def concerns(self, *sections: str) -> bool:
        """Whether a problem lies in one of these top-level sections, or in the text as a whole."""
        return any(problem.key.partition(".")[0] in ("", *sections) for problem in self.problems)

    def report_validation(self, error: ValidationError, root: type[Model], prefix: KeyPath) -> None:
        """Note every error of the validation of the part at `prefix`, in words."""
        for item in error.errors(include_url=False):
            location = (*prefix, *item["loc"])
            at_key = location[-1] == "[key]"
            if at_key:
                location = location[:-1]
            kind = item["type"]
            if kind == "extra_forbidden":
                names = schema_fields(root, location[:-1])
                self.report(location, unknown_key(str(location[-1]), names), at_key=True)
            elif kind == "missing":
                self.report(location, f"is missing{_meaning(root, location)}", at_key=True)
            else:
                message = item["msg"] if kind == "study" else f"expected {_EXPECTED[kind]}, not {shown(item['input'])}"
                if kind in _MAPPINGS and isinstance(item["input"], str) and ":" in item["input"]:
                    message += "; a ':' needs a space after it"
                *holder, last = self.document.written(location)
                # For a whole mapping pydantic's path ends with the name of the form.
                location = location if has(self.document.raw(holder), last) else tuple(holder)
                self.report(location, message, at_key=at_key)

    def mended(self, error: ValidationError, root: type[Model], key: str, raw: Any) -> Any:
        """The data of a top-level part with the mistakes of a validation corrected or removed, where possible.

        Wrong numbers are lost, unknown keys take the name that they resemble or are left out.
        """
        part = plain(raw)
        for item in error.errors(include_url=False):
            location = (key, *item["loc"])
            *inner, last = self.document.written(location)[1:] or (None,)
            holder: Any = part
            for segment in inner:
                holder = holder[segment] if has(holder, segment) else None
            if item["type"] == "extra_forbidden" and isinstance(holder, dict) and last in holder:
                value = holder.pop(last)
                near = nearest(str(last), schema_fields(root, location[:-1]))
                if near is not None:
                    holder.setdefault(near, value)
            elif has(holder, last) and isinstance(holder[last], int | float | str):
                holder[last] = LOST
        return part


def _meaning(root: type[Model], location: Sequence[str | int]) -> str:
    """The first sentence of a key's description, for a message."""
    model = _model(root, location[:-1])
    text = "" if model is None else model.said(str(location[-1])).text
    sentence = text.partition(". ")[0].removesuffix(".")
    return f": {sentence[0].lower()}{sentence[1:]}" if sentence else ""


def schema_fields(root: type[Model], location: Sequence[str | int]) -> dict[str, FieldInfo]:
    """Fields, by their keys in the text, of the model at a location of the schema; none where there is no model."""
    model = _model(root, location)
    return {} if model is None else model.fields_by_key()


def _model(root: type[Model], location: Sequence[str | int]) -> type[Model] | None:
    """The model at a location of the schema, None if there is none."""
    current: Any = root
    for segment in (*location, None):
        tagged = False
        while get_origin(current) in (Annotated, Union, UnionType) and not tagged:
            arms = [arm for arm in get_args(current) if arm is not NoneType]
            # pydantic's path contains the tag of the form.
            named = [arm for arm in arms if any(isinstance(tag, Tag) and tag.tag == segment for tag in get_args(arm))]
            current, tagged = (named or arms)[0], bool(named)
        if tagged:
            continue
        model = current if isinstance(current, type) and issubclass(current, Model) else None
        if segment is None:
            return model
        if get_origin(current) in (dict, tuple):
            current = get_args(current)[-1 if get_origin(current) is dict else 0]
        else:
            field = None if model is None else model.fields_by_key().get(str(segment))
            current = None if field is None else field.annotation
    return None

"""From the text or the data of a study to a validated `Study`."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import pathlib
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from mechdesign.commands import COMMANDS, SECTIONS
from mechdesign.ground.errors import MechanismError, Problem, StudyError, few_comparisons
from mechdesign.ground.expressions import Expression
from mechdesign.ground.functions import RESERVED
from mechdesign.ground.work.threads import one_thread
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.mechanism import Variant
from mechdesign.mechanism.model import Description
from mechdesign.study.building.builder import Builder
from mechdesign.study.building.description import build
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.building.section import MechanismSection, UnitsSection
from mechdesign.study.loaded import TEXT, UNNAMED, Study, StudySource
from mechdesign.study.schema import doubts, targets
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.conditions import check_result
from mechdesign.study.schema.entries import check_variables, check_varied
from mechdesign.study.schema.poses import PoseSection
from mechdesign.study.schema.study_file import annotation_of, keys_at, model_of, override
from mechdesign.study.text.document import MAX_BYTES, Document, plain, read
from mechdesign.study.text.fields import NAME
from mechdesign.study.text.given import override_texts, plain_data
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import LOST, Context, read_number, shown
from mechdesign.study.text.reporter import Reporter, unknown_key
from mechdesign.study.text.units import Units

# Keys of the sections of questions.
_ASKED = tuple(command.key for command in COMMANDS.values())


def read_file(file: pathlib.Path) -> bytes:
    """The text of a study file, at most one byte more than is allowed.

    Raises
    ------
    StudyError
        If it cannot be read.
    """
    try:
        with file.open("rb") as stream:
            return stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise StudyError([Problem(f"cannot be read: {why}", file=str(file))]) from None


def load_data(
    mapping: Mapping[str, Any], overrides: Sequence[str] | Mapping[str, Any], seed: int | None, folder: Folder,
    drawn: Mapping[str, Any] | None = None,
) -> Study:  # fmt: skip
    """Load a study from a mapping, perhaps with overrides in it (see `Study.drawn`); files that it names lie in a
    folder.
    """
    data = plain_data(mapping, "the study")
    source = StudySource(None, folder, sha256=hashlib.sha256(json.dumps(data).encode()).hexdigest())
    return _load_changed(Document.of(data), source, override_texts(overrides), seed, drawn)


@one_thread()
def load_bytes(
    content: bytes,
    path: pathlib.Path | None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    seed: int | None = None,
    folder: Folder | None = None,
) -> Study:
    """Load a study from the bytes of a file. Without a `folder`, files that it names lie beside it."""
    folder = folder or Folder(path.parent if path is not None else pathlib.Path())
    source = StudySource(path, folder, content, hashlib.sha256(content).hexdigest())
    return _load_changed(read(content, str(path or TEXT)), source, override_texts(overrides), seed)


def _drawing(document: Document) -> dict[str, Any]:
    """The units and the mechanism of a study, which determine how its sketch is assembled."""
    data = document.data if isinstance(document.data, dict) else {}
    return {key: plain(data[key]) for key in ("units", "mechanism") if data.get(key) is not None}


def _load_changed(
    document: Document, source: StudySource, changes: tuple[str, ...], seed: int | None,
    drawn: Mapping[str, Any] | None = None,
) -> Study:  # fmt: skip
    """Load a study with overrides; the assembly is that of the mechanism before them, `drawn`, if it has one."""
    drawn = drawn or _drawing(document)
    override(document, changes)
    if drawn == _drawing(document) or not same_sketch(drawn, document.data):
        return load_document(document, source, changes, seed)
    original = None
    with contextlib.suppress(StudyError):
        original = load_document(Document.of(plain(drawn)), StudySource(source.path, source.folder)).mechanism
    study = load_document(document, source, changes, seed, original)
    if not isinstance(study.mechanism, Variant):
        return study
    warnings = [*study.warnings]
    if not study.mechanism.closes:
        warnings.append(study.problem(
            "with the changed numbers it cannot be assembled at its own drive values; poses are in the assembly that "
            "it shows without the change", "mechanism", "sketch",
        ))  # fmt: skip
    # With all units, as in the data of the study.
    drawn = {**drawn, "units": study.resolved["units"]}
    return dataclasses.replace(study, drawn=drawn, warnings=tuple(warnings))


def same_sketch(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether the data of two studies have the same sketch, in the same units."""
    mechanisms = [data["mechanism"] if isinstance(data.get("mechanism"), dict) else {} for data in (one, other)]
    return one.get("units") == other.get("units") and mechanisms[0].get("sketch") == mechanisms[1].get("sketch")


@few_comparisons()
def load_document(
    document: Document,
    source: StudySource,
    changes: tuple[str, ...] = (),
    seed: int | None = None,
    original: Mechanism | None = None,
) -> Study:
    """Load a study from the data of a file, overrides applied.

    Where it differs from the `original` in numbers alone the assembly is that of the original; else the sketch chooses.
    """
    if seed is not None and seed < 0:
        raise StudyError(f"the seed is a whole number from 0 on, not {seed}")
    reporter = Reporter(document)
    data = _begun(_sections(document, reporter), reporter)
    context, formulas = context_of(data, reporter)
    parts = _validated(data, context, reporter)
    section: MechanismSection | None = parts.get("mechanism")
    if section is None:
        reporter.done()
    assert section is not None
    builder = Builder(section, context, reporter, source.folder)
    description = build(builder)
    # Mobility and sketch are checked if the mechanism itself has no mistakes, even if other sections have.
    wrong = reporter.concerns("mechanism", "units")
    mechanism = None if wrong else _compiled(description, reporter, original)
    parameters = builder.parameters(formulas)
    checker = Checker(builder, parameters, parts, source.folder, mechanism)
    parts = _checked(checker)
    _check_use(parts, parameters, context, reporter)
    reporter.done()
    assert mechanism is not None
    doubts.note(checker, parts, mechanism)
    name = parts.get("name") or (source.path.stem if source.path is not None else UNNAMED)
    seed = parts["seed"] if seed is None else seed
    named = {"name": name, "seed": seed, "units": dataclasses.asdict(context.units)}
    study = Study(
        name=name,
        path=source.path,
        text=source.text,
        text_sha256=source.sha256,
        seed=seed,
        overrides=changes,
        units=context.units,
        resolved=plain(document.data) | named,
        mechanism=mechanism,
        parameters=parameters,
        sections={key: parts[key] for key in SECTIONS if key in parts},
        requirements=parts["requirements"],
        fail_on=parts["fail_on"],
        strict=False,
        targets={owner: target for owner, target in parts["targets"].items() if target.closed is None},
        curves={owner: target for owner, target in parts["targets"].items() if target.closed is not None},
        kinds=reporter.kinds,
        fixed=frozenset(context.fixed),
        folder=source.folder,
        warnings=reporter.warnings,
    )
    _check_poses(study, reporter)
    reporter.done()
    return study


def _sections(document: Document, reporter: Reporter) -> dict[str, Any]:
    """The top level of the study; an empty section becomes an empty mapping."""
    data = document.data
    if not isinstance(data, dict):
        message = "is not a study: a mapping with 'mechanism' is expected, not " + shown(data)
        raise document.values[()].failure(message)
    return {key: {} if value is None and key in _ASKED else value for key, value in data.items()}


def _begun(data: dict[str, Any], reporter: Reporter) -> dict[str, Any]:
    """Give a study that has a task and no mechanism but parameters the one with which a synthesis begins."""
    task, written = SECTIONS["synthesis"], data.get("mechanism") or {}
    if data.get(task.key) is None or not isinstance(written, dict) or written.keys() - {"parameters"}:
        return data
    for key in _ASKED:
        if key != task.key and key in data:
            words = (
                f"asks about a mechanism, and this study has only a task; the studies that {task.name} writes have one"
            )
            reporter.report((key,), words, at_key=True)
    return data | {"mechanism": {**plain(task.model.starting(data[task.key])), **written}}


def context_of(data: Mapping[str, Any], reporter: Reporter) -> tuple[Context, dict[str, Expression]]:
    """Units and parameters, which are needed to read all other numbers."""
    units = Units()
    # A wrong unit is reported later, with the mistakes of other sections.
    with contextlib.suppress(ValidationError):
        units = Units(**UnitsSection.model_validate(data.get("units") or {}).model_dump())
    mechanism = data.get("mechanism")
    raw = mechanism.get("parameters") if isinstance(mechanism, dict) else None
    raw = raw if isinstance(raw, dict) else {}
    nominal: dict[str, float] = {}
    quantities: dict[str, str] = {}
    formulas: dict[str, Expression] = {}
    for name, value in raw.items():
        path = ("mechanism", "parameters", name)
        if not NAME.fullmatch(name):
            message = "a parameter's name is letters, digits and underscores, with a letter first"
            reporter.report(path, message, at_key=True)
        elif name in RESERVED:
            message = f"{name!r} is a word of the expression language; choose another name"
            reporter.report(path, message, at_key=True)
        try:
            number = read_number(
                value, Context(units, nominal, [other for other in raw if other not in nominal], quantities)
            )
        except PydanticCustomError as error:
            reporter.report(path, error.message())
            number = LOST
        nominal[name] = float(number)
        if text := number.text:
            quantities[name] = text
        if number.expression is not None:
            formulas[name] = number.expression
    return Context(units, nominal, quantities=quantities), formulas


def _validated(data: Mapping[str, Any], context: Context, reporter: Reporter) -> dict[str, Any]:
    """Validate each top-level key by itself, so that all mistakes are found; wrong parts are left out."""
    parts: dict[str, Any] = {"seed": 0, "requirements": (), "fail_on": ()}
    names = keys_at(())
    for key in data:
        if key not in names:
            reporter.report((key,), unknown_key(key, names), at_key=True)
    model = model_of(data)
    for key, field in model.model_fields.items():
        raw = data.get(key)
        if raw is None:
            if field.is_required():
                reporter.report(
                    (key,), "is missing: a study describes a mechanism; 'mechdesign new' prints one to begin with"
                )
            continue
        if key == "mechanism" and isinstance(raw, dict):
            # The parameters have been read by `context_of`.
            raw = {name: value for name, value in raw.items() if name != "parameters" or not isinstance(value, dict)}
        validator = adapter(key)
        try:
            parts[key] = validator.validate_python(raw, context=context)
        except ValidationError as error:
            reporter.report_validation(error, model, (key,))
            # If only numbers and keys are wrong, the names in this part can still be checked.
            with contextlib.suppress(ValidationError):
                parts[key] = validator.validate_python(reporter.mended(error, model, key, raw), context=context)
    return parts


def _checked(checker: Checker) -> dict[str, Any]:
    """Check the validated sections and the targets; returns them with wildcards and defaults filled in."""
    if "optimize" in checker.parts:
        checker.parts["optimize"] = check_variables(checker.parts["optimize"], checker)
    sections = dict(checker.parts)
    for name in checker.parameters.kinds:
        for kind in checker.parameters.needed(name, checker.places):
            checker.kind(("mechanism", "parameters", name), kind)
    sections |= {key: sections[key].checked(checker) for key in _ASKED if key in sections}
    for index, requirement in enumerate(sections["requirements"]):
        check_result(checker, requirement.result, ("requirements", index, "result"), required=True)
    if "matrix" in sections:
        sections["matrix"].checked(checker)
        check_varied(sections["matrix"], checker)
    if "sensitivities" in sections:
        sections["sensitivities"].checked(checker)
    sections["targets"] = targets.check(checker, checker.mechanism.targets)
    return sections


def _check_poses(study: Study, reporter: Reporter) -> None:
    """Check that poses determine the mechanism and are not too many, and that the targets fit the poses of
    kinematics.
    """
    for command in COMMANDS:
        section = study.sections.get(command)
        key = section.source if isinstance(section, PoseSection) and not section.at_nodes else None
        if key is not None:
            try:
                poses = study.motions[command]
            except StudyError as error:
                reporter.report((command, key), str(error))
                continue
            for k, names in enumerate(poses.rule.kinds or [poses.names]):
                try:
                    study.mechanism.plan(names)
                except MechanismError as error:
                    first = [] if key != "poses" else [int(poses.groups[k].rows[0])]
                    reporter.report((command, key, *first), str(error))
            if poses.rule.path is None and key == "path" and getattr(section, "speed", None) is not None:
                reporter.report(
                    (command, "speed"),
                    "the path's point does not move: it has no direction; give two different places",
                    at_key=True,
                )
        if command == "kinematics" and (study.targets or study.curves):
            try:
                assumed = study.motions[command]
            except StudyError:
                continue
            targets.check_poses({**study.targets, **study.curves}, study.mechanism, assumed, reporter)


def _check_use(parts: Mapping[str, Any], parameters: Parameters, context: Context, reporter: Reporter) -> None:
    """Report parameters that no number, design variable or varying dimension uses."""
    if reporter.problems:
        # A part with a mistake may use them.
        return
    optimize, reliability = parts.get("optimize"), parts.get("reliability")
    used = context.used.union(
        *(formula.names for formula in parameters.dependent.values()),
        optimize.variables if optimize else (),
        reliability.dimensions if reliability else (),
    )
    for name, formula in reversed([*parameters.formulas.items()]):
        # A parameter may use those above it.
        if name in used:
            used |= formula.names
    for name in parameters.nominal:
        if name not in used:
            others = [other for other in parameters.nominal if other != name]
            reporter.unused(("mechanism", "parameters", name), "parameter", others)


@cache
def adapter(key: str) -> TypeAdapter[Any]:
    """Validator of one top-level key."""
    return TypeAdapter(annotation_of(key))


def _compiled(description: Description, reporter: Reporter, original: Mechanism | None) -> Mechanism | None:
    alike = original is not None and _alike(description, original.description)
    try:
        return Variant(original, description) if alike and original is not None else Mechanism(description)
    except MechanismError as error:
        reporter.report(error.key.split("."), str(error))
        return None


def _alike(one: Description, other: Description) -> bool:
    """Whether two mechanisms differ only in numbers."""
    return dataclasses.replace(one, places=other.places, sketch=other.sketch) == other

"""`convert`: from a file or an address of another tool to the text of a study that runs."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.ground.errors import AssemblyError, MechdesignError, StudyError, cut
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.study.importing.draft import Draft
from mechdesign.study.importing.formats import FORMATS
from mechdesign.study.importing.sketch import FileDrive, FileSketch
from mechdesign.study.importing.source import ImportedText
from mechdesign.study.importing.writer import STEPS, Writer
from mechdesign.study.loading import load_bytes

# Most links that move against each other.
MOST_LINKS = 200


def convert(
    source: str | os.PathLike[str] | None = None,
    *,
    text: str | None = None,
    drives: Sequence[str] = (),
    unit: str | None = None,
    scale: float | None = None,
) -> str:
    """Convert what another tool has saved to a commented study in YAML, which `load` takes as its `text`.

    Parameters
    ----------
    source : str or path
        A share address of PMKS+, a file of PMKS+, PMKS, Linkage or pylinkage, a DXF, JSON of joints and links, or a
        folder with ``joints.csv`` and ``links.csv``. Nothing is fetched: an address holds the whole mechanism.
    text : str
        The text of such a file, or an address, in place of `source`.
    drives : sequence of str
        What is driven, in place of the file's inputs: pins of two links (the ground is one), links or slides, by their
        names in the file.
    unit : str
        Unit of length in place of the file's; numbers stay as they are.
    scale : float
        Factor of all lengths, before `unit`.

    Returns
    -------
    str
        The study. Its comments say what became what and what was left out.

    Raises
    ------
    StudyError
        If the format is none of these, the file is broken, or what it shows is no mechanism that can be driven.

    Examples
    --------
    >>> import mechdesign
    >>> arm = '{"joints": [{"name": "O", "x": 0, "y": 0, "ground": "yes", "drive": "60 rpm"}, \
{"name": "P", "x": 3, "y": 4}], "links": [{"name": "arm", "joints": ["O", "P"]}]}'
    >>> study = mechdesign.load(text=mechdesign.convert(text=arm))
    >>> study.mechanism.drives
    ('arm',)
    """
    if (source is None) == (text is None):
        raise StudyError("give a source, or a text in its place")
    return conversion(source, text=text, drives=drives, unit=unit, scale=scale)[0]


def conversion(
    source: str | os.PathLike[str] | None, *, text: str | None = None, drives: Sequence[str], unit: str | None,
    scale: float | None,
) -> tuple[str, tuple[str, ...]]:  # fmt: skip
    """A study as `convert` makes it, and what is to be moved in its sketch before it runs, such as at a dead centre."""
    origin = ImportedText.of(os.fspath(source)) if source is not None else ImportedText.of_text(text or "")
    if not origin.text.strip():
        raise StudyError(f"{cut(origin.name)} is empty")
    for kind in FORMATS:
        if kind.recognises(origin):
            sketch: FileSketch = kind.read(origin)
            break
    else:
        names = "; ".join(kind.NAME for kind in FORMATS)
        raise StudyError(f"the format of {cut(origin.name)} is not known; what can be imported: {names}")
    if not sketch.links:
        raise StudyError(f"{cut(origin.name)} has no links")
    if not sketch.fixed:
        raise StudyError(f"no joint of {cut(origin.name)} is on the ground: nothing holds the mechanism")
    if scale is not None:
        _scale(sketch, scale)
    if unit is not None:
        sketch.units["length"] = unit
    _choose(sketch, drives)
    draft = Draft(sketch)
    if len(draft.moving) > MOST_LINKS:
        count = len(draft.moving)
        raise StudyError(f"the mechanism has {count} moving links, more than {MOST_LINKS}: take a part of it")
    return _settled(draft, cut(origin.name))


def _scale(sketch: FileSketch, factor: float) -> None:
    if not 0 < factor < 1e6:
        raise StudyError(f"a scale of {factor:g}; it is a positive number")
    sketch.points = {name: factor * place for name, place in sketch.points.items()}
    for link in sketch.links.values():
        link.center = None if link.center is None else factor * link.center
        link.inertia = None if link.inertia is None else factor**2 * link.inertia
    sketch.forces = [replace(force, place=factor * force.place) for force in sketch.forces]
    sketch.gears = [
        replace(gears, radius=None if gears.radius is None else factor * gears.radius) for gears in sketch.gears
    ]
    for index, drive in enumerate(sketch.drives):
        if drive.kind != "angle":
            span = None if drive.span is None else (factor * drive.span[0], factor * drive.span[1])
            speed = None if drive.speed is None else factor * drive.speed
            sketch.drives[index] = replace(drive, span=span, speed=speed)
    sketch.choices.append(f"all lengths are multiplied by {factor:g}")


def _choose(sketch: FileSketch, chosen: Sequence[str]) -> None:
    """Take what `drives` names in place of the file's inputs; ask where neither says anything."""
    if chosen:
        sketch.drives = [_named(sketch, name) for name in chosen]
        return
    if not sketch.drives:
        choices = {
            "pins of the ground": [name for name in sketch.fixed if len(sketch.turned_at(name)) == 2],
            "slides": [*sketch.slides],
        }
        if not any(choices.values()):
            choices = {"links": [*sketch.links]}
        named = "; ".join(f"{noun}: {', '.join(map(repr, names[:12]))}" for noun, names in choices.items() if names)
        raise StudyError(f"the file says of no joint that it is driven: choose with --drive; {named}")
    kept: dict[tuple[str, str], FileDrive] = {}
    for drive in sketch.drives:
        kept.setdefault((drive.kind, drive.of), drive)
    sketch.drives = list(kept.values())
    if len(kept) > 1:
        by_hand = [repr(drive.of) for drive in sketch.drives if drive.held]
        sketch.choices += [f"input {name} is moved by hand there, and held here" for name in by_hand]


def _named(sketch: FileSketch, name: str) -> FileDrive:
    """The drive that a name stands for, with the speed that the file has for it."""
    if name in sketch.fixed:
        chosen = sketch.drive_at(name)
    elif name in sketch.links:
        chosen = FileDrive("length" if sketch.links[name].telescopic else "angle", name)
    elif name in sketch.slides:
        chosen = FileDrive("slide", name)
    elif name in sketch.points:
        chosen = sketch.drive_at(name)
    else:
        raise StudyError(f"--drive {cut(name)}: no joint, link or slide of the file has this name")
    return next((drive for drive in sketch.drives if drive.of == chosen.of), chosen)


def _settled(draft: Draft, source: str) -> tuple[str, tuple[str, ...]]:
    """The study, whose drive goes no farther than the mechanism lets it; and what its sketch leaves undecided."""
    writer, spans = Writer(draft), {name: draft.span(name) for name in draft.drives}
    text = writer.text(source, spans)
    try:
        study = load_bytes(text.encode(errors="surrogateescape"), None)
    except StudyError as error:
        reasons = tuple(f"{problem.key}: {problem.message}" for problem in error.problems[:3])
        if all(problem.key == "mechanism.sketch" for problem in error.problems):
            return writer.text(source, spans, undecided=reasons), reasons
        raise StudyError(f"what the file shows is no mechanism that its inputs drive: {'; '.join(reasons)}") from None
    except MechdesignError as error:
        raise StudyError(f"what the file shows is no mechanism that its inputs drive: {error}") from None
    solve = study.mechanism.solve
    if not solve({name: [draft.start(name)] for name in spans}).valid.all():
        raise AssemblyError("the mechanism cannot be assembled as the file shows it, or a slide is beyond its limits")
    if len(spans) > 1:
        return text, ()
    ((name, drive),) = draft.drives.items()
    start = draft.start(name)
    turns = drive.kind == "angle" and drive.span is None
    wide = (start - 180, start + 180) if turns else spans[name]
    low, high = (_farthest(lambda values: solve({name: values}).valid, start, end) for end in wide)
    if (low, high) == wide:
        return text, ()
    remark = f"{name} goes from {low:.4g} to {high:.4g}; outside the links do not meet, or a limit is passed"
    return writer.text(source, {name: (low, high)}, [remark]), ()


def _farthest(valid: Callable[[Floats], Flags], start: float, end: float) -> float:
    """How far a drive goes from its start towards an end while the mechanism is assembled."""
    inside, outside = start, end
    for _ in range(3):
        values = np.linspace(inside, outside, STEPS + 1)
        gaps = np.flatnonzero(~valid(values))
        if not len(gaps):
            return outside
        inside, outside = float(values[gaps[0] - 1]), float(values[gaps[0]])
    return inside

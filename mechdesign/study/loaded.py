"""A study that was read and checked."""

from __future__ import annotations

import dataclasses
import pathlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

from mechdesign.commands import COMMANDS, SECTIONS
from mechdesign.ground.cautions import ALL, Caution
from mechdesign.ground.errors import Problem, StudyError
from mechdesign.ground.files import portable
from mechdesign.mechanism import Mechanism
from mechdesign.motion.motion import Motion
from mechdesign.motion.rows import Poses
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.motions import Motions
from mechdesign.study.schema.conditions import Requirement
from mechdesign.study.schema.study_file import override
from mechdesign.study.schema.targets import Target
from mechdesign.study.text.document import Document, KeyPath, read
from mechdesign.study.text.inputs import Folder, files
from mechdesign.study.text.reading import shown
from mechdesign.study.text.reporter import Reporter
from mechdesign.study.text.units import Units

if TYPE_CHECKING:
    from mechdesign.experiments.schema.matrix import MatrixSection
    from mechdesign.experiments.schema.sensitivities import SensitivitiesSection
    from mechdesign.questions.dynamics.schema import DynamicsSection
    from mechdesign.questions.kinematics.schema import KinematicsSection
    from mechdesign.questions.optimize.schema import OptimizeSection
    from mechdesign.questions.reliability.schema.section import ReliabilitySection
    from mechdesign.questions.stiffness.schema import StiffnessSection
    from mechdesign.questions.synthesize.schema import SynthesisSection
    from mechdesign.questions.workspace.schema import WorkspaceSection

# Characters that are replaced in the folder's name, and the name of a study without one.
_UNFIT = re.compile(r"[^\w.-]+")
UNNAMED = "study"
# Name in messages of a study given as a text.
TEXT = "<study>"


@dataclass(frozen=True)
class StudySource:
    """What a study is read from: its file and text, empty of a mapping, and the folder of the files that it names."""

    path: pathlib.Path | None
    folder: Folder
    text: bytes = b""
    sha256: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """A validated study; sections that its file does not have are None.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... kinematics: {poses: [{arm: 60}]}
    ... ''')
    >>> study.questions, study.units.label("velocity"), study.mechanism.drives
    (('kinematics',), 'mm/s', ('arm',))
    """

    name: str  #: by default that of its file
    path: pathlib.Path | None  #: None of a study that was given as a text or a mapping
    text: bytes  #: as it was read; empty of a mapping
    text_sha256: str
    seed: int  #: of the random numbers
    overrides: tuple[str, ...]  #: as ``a.b.c=value``, in the order in which they were applied
    units: Units  #: of lengths, angles, forces and times, in the file as in the results
    resolved: dict[str, Any]  #: the study as plain data, overrides applied
    mechanism: Mechanism  #: which solves any pose
    parameters: Parameters
    sections: Mapping[str, Any]  #: by their keys; also as attributes, ``study.kinematics``
    requirements: tuple[Requirement, ...]  #: in the order of the file
    fail_on: tuple[str, ...]  #: kinds of warnings that no result, and no case of a sweep, may have
    targets: Mapping[str, Target]  # by the coordinate or point
    curves: Mapping[str, Target]  # by the point whose path shall pass them at whatever time
    kinds: Mapping[KeyPath, str]  # kinds of quantities of entries outside the geometry, and of the entries below them
    fixed: frozenset[str]  # parameters used in whole numbers, which are the same for every design
    folder: Folder  #: folder of the files that it names, with their contents when it was loaded
    drawn: Mapping[str, Any] | None = None  #: units and mechanism before overrides, whose sketch shows the assembly
    strict: bool = False  #: whether every kind of warning fails, not only those of `fail_on`
    warnings: tuple[Problem, ...] = ()  #: likely mistakes, such as a parameter that nothing uses

    if TYPE_CHECKING:
        kinematics: ClassVar[KinematicsSection | None]
        workspace: ClassVar[WorkspaceSection | None]
        optimize: ClassVar[OptimizeSection | None]
        reliability: ClassVar[ReliabilitySection | None]
        stiffness: ClassVar[StiffnessSection | None]
        dynamics: ClassVar[DynamicsSection | None]
        matrix: ClassVar[MatrixSection | None]
        sensitivities: ClassVar[SensitivitiesSection | None]
        synthesis: ClassVar[SynthesisSection | None]

    def __getattr__(self, name: str) -> Any:
        if name in SECTIONS:
            return self.sections.get(name)
        raise AttributeError(f"a study has no {name!r}")

    def with_sections(self, **sections: Any) -> Self:
        """The study with other sections, by their keys."""
        return dataclasses.replace(self, sections={**self.sections, **sections})

    def __getstate__(self) -> dict[str, Any]:
        return {part.name: getattr(self, part.name) for part in dataclasses.fields(self)}

    @cached_property
    def motions(self) -> Motions:
        """Poses by command, as rules; see `Motions`."""
        return Motions(self.sections, self.mechanism.description, self.folder)

    @cached_property
    def questions(self) -> tuple[str, ...]:
        """Commands that the study has a section for."""
        return tuple(name for name, command in COMMANDS.items() if self.sections.get(command.key) is not None)

    @property
    def is_task(self) -> bool:
        """Whether it has a task and no mechanism: what it computes with is the kind with which a synthesis begins."""
        return not (self.resolved.get("mechanism") or {}).keys() - {"parameters"}

    def need_mechanism(self, who: str) -> None:
        """Refuse what asks about a mechanism where the study has none.

        Raises
        ------
        StudyError
            If it has only a task.
        """
        if self.is_task:
            words = f"{who} asks about a mechanism, and this study has only a task"
            raise StudyError(
                [self.problem(f"{words}: synthesize finds linkages, each a study of its own", "synthesis")]
            )

    @property
    def source(self) -> StudySource:
        """What it was read from."""
        return StudySource(self.path, self.folder, self.text, self.text_sha256)

    @property
    def barred(self) -> tuple[str, ...]:
        """Kinds of warnings that fail a run."""
        return (ALL,) if self.strict else self.fail_on

    @property
    def cautions(self) -> dict[Caution, Problem]:
        """Likely mistakes as warnings of its results, each with its place in the study."""
        return {Caution("suspect", f"{problem.key}: {problem.message}"): problem for problem in self.warnings}

    @property
    def sizes(self) -> dict[str, float]:
        """Nominal values of the places of the geometry, lengths and radians, and of the parameters."""
        return {**self.mechanism.nominal, **self.parameters.nominal}

    @property
    def size(self) -> tuple[float, str]:
        """The size of its mechanism with the unit, beside which numbers are rounding."""
        return self.mechanism.size, self.units.label("length")

    @property
    def label(self) -> str:
        """The name of its folder of results, that of its file or else its own."""
        return folder_name(self.path, self.name)

    def __repr__(self) -> str:
        questions = ", ".join(self.questions) or "no question"
        return f"<Study {shown(self.name)}: mobility {self.mechanism.mobility}; {questions}>"

    def inputs(self) -> Iterator[tuple[KeyPath, pathlib.Path, str]]:
        """Files that the study reads: path of the key, file, and its text when the study was loaded."""
        for keys, name in files(self.resolved, self.questions):
            yield keys, self.folder.path / name, self.folder.text(name)

    def motion(self, poses: Poses) -> Motion:
        """Its mechanism in some poses."""
        return Motion(self.mechanism, self.units, poses)

    def unit_of(self, name: str) -> str | None:
        """Unit of a number of the geometry, a drive, or a parameter; None if it is not known.

        See `Parameters.kind` for that of a parameter.
        """
        parameters, places = self.parameters, self.mechanism.description.places
        if name in places:
            return self.units.label(places[name].quantity)
        if name not in parameters.nominal:
            return self.units.label(self.mechanism.quantity(name)) if name in self.mechanism.drives else None
        kind = parameters.kind(name, places)
        return None if kind is None else self.units.label(kind)

    def problem(self, message: str, *keys: str | int) -> Problem:
        """A mistake at a path of the data, with its place in the text."""
        if not self.text:
            return Problem(message, ".".join(map(str, keys)))
        reporter = Reporter(self._document)
        reporter.report(keys, message)
        return reporter.problems[-1]

    @cached_property
    def _document(self) -> Document:
        """The text read again, with the places of its entries."""
        document = read(self.text, str(self.path or TEXT))
        override(document, self.overrides)
        return document


def folder_name(path: pathlib.Path | None, name: str = "") -> str:
    """What a study's results are called, by its file or else its name: a folder that every system takes."""
    stem = path.stem if path is not None else _UNFIT.sub("_", name).strip("._")
    return portable(stem or UNNAMED)

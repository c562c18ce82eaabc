"""A study and an answer as a notebook holds them: they show themselves, draw their pictures and save their files."""

from __future__ import annotations

import dataclasses
import os
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from mechdesign.commands import QUESTIONS
from mechdesign.door.report import writer
from mechdesign.door.report.manifest import Extras, check_folder, read_by
from mechdesign.door.report.names import MECHANISM
from mechdesign.door.report.requirements import Verdict, requirements
from mechdesign.ground.errors import MechdesignError, StudyError, counted, explain, suggestion
from mechdesign.ground.files import formats_of, owned
from mechdesign.ground.results import Result
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes, read_file
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mechdesign.door.live.frame import LiveFrame
    from mechdesign.drawing.rendering import Gallery


class ShownStudy(Study):
    """A study that shows its mechanism in a notebook."""

    @classmethod
    def of(cls, study: Study) -> ShownStudy:
        """The same study."""
        return cls(**{field.name: getattr(study, field.name) for field in dataclasses.fields(Study)})

    def __repr__(self) -> str:
        mechanism = self.mechanism
        words = "a task, no mechanism" if self.is_task else ", ".join((
            counted(len(mechanism.description.links), "link"), f"mobility {mechanism.mobility}",
            f"driven by {', '.join(mechanism.drives) or 'nothing'}",
        ))  # fmt: skip
        warned = f"; {counted(len(self.warnings), 'warning')}" if self.warnings else ""
        return f"<Study {shown(self.name)}: {words}\n  asks {', '.join(self.questions) or 'no question'}{warned}>"

    def live(self, height: int = 800) -> LiveFrame:
        """Its page in a frame of a notebook, in which dimensions are dragged; see ``mechdesign live``.

        Parameters
        ----------
        height : int
            Of the frame, in pixels.

        Raises
        ------
        MechdesignError
            If nothing of it moves.
        """
        from mechdesign.door.live.frame import LiveFrame

        path, folder = self.path, self.folder
        if path is None:
            return LiveFrame(self, None, height)

        def load() -> Study:
            # The files that it names are read anew, too.
            again = Folder(folder.path, folder.anywhere, folder.given)
            return load_bytes(read_file(path), path, self.overrides, self.seed, again)

        return LiveFrame(self, load, height)

    def _repr_html_(self) -> str:
        from mechdesign.door.api.html import study_html

        return study_html(self, self._repr_png_())

    def _repr_png_(self) -> bytes | None:
        return self._picture

    @cached_property
    def _picture(self) -> bytes | None:
        """The sketch as it is assembled; None where it cannot be drawn, or there is none."""
        if self.is_task:
            return None
        try:
            return writer.sketch(self)
        except Exception as error:
            _undrawn(MECHANISM, explain(error)[1])
            return None


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer(Result):
    """The result of one command that knows its study.

    >>> import mechdesign
    >>> arm = "mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}"
    >>> result = mechdesign.kinematics(mechdesign.load(text=arm))
    >>> list(result.tables), result.main is result.tables["motion"], result.counts["poses"]
    (['motion', 'extremes', 'limits'], True, 73)
    """

    study: Study  #: with the seed that was computed with
    all_modes: bool = False  #: whether every assembly mode was asked

    @classmethod
    def of(cls, study: Study, result: Result, seed: int | None = None, *, all_modes: bool = False) -> Answer:
        """The answer that a result is, computed with a seed in place of the study's."""
        if seed is not None:
            study = dataclasses.replace(study, seed=seed, resolved=study.resolved | {"seed": seed})
        values = {field.name: getattr(result, field.name) for field in dataclasses.fields(Result)}
        return cls(**values, study=study, all_modes=all_modes)

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts on the requirements that concern this result and on its warnings; none where it was interrupted.

        Raises
        ------
        StudyError
            If a requirement names what the result has not.
        """
        return () if self.interrupted else requirements(self.study, self)

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of its pictures, in the order in which they are best read."""
        return self._gallery[0]

    def figure(self, name: str) -> Figure:
        """One of its pictures, made anew and yours to change: Matplotlib's, in inches, without pyplot.

        In a notebook it shows itself; Matplotlib's settings stay as they are.

        Raises
        ------
        StudyError
            If there is none of that name; the message lists those there are.
        MechdesignError
            If it could not be drawn.
        """
        if (figure := self._drawn(name).get(name)) is not None:
            return figure
        drawn = self._drawn()
        if name in drawn.failed:
            raise MechdesignError(f"picture {name} could not be drawn: {drawn.failed[name]}")
        there = f"there are {', '.join(drawn)}" if drawn else "there are none"
        failed = "".join(f"; pictures {picture} could not be drawn: {why}" for picture, why in drawn.failed.items())
        raise StudyError(f"{self.command} has no picture {shown(name)}{suggestion(name, drawn)}; {there}{failed}")

    def save(
        self,
        directory: str | os.PathLike[str],
        *,
        plots: bool = True,
        formats: str | None = None,
        animate: bool = False,
    ) -> Path:
        """Write the files that the command writes with ``--out DIRECTORY``, to the byte, and return their folder.

        Parameters
        ----------
        directory : path
            Is made where it is not there. Files of an older result in it that this one does not have are removed.
        plots : bool
            Whether to draw pictures; those that cannot be drawn are Python warnings, and stand in the manifest.
        formats : str
            Of the pictures: png, svg, pdf, or several with commas between; png by default.
        animate : bool
            Whether to draw the motion of a sweep or path as well, ``motion.gif``.

        Raises
        ------
        StudyError
            If a requirement names what the result has not, formats or the animation are asked amiss, or a file would be
            replaced that no manifest there lists, or that the study reads.
        OutputError
            If the files cannot be written.
        """
        if animate and self.command != "kinematics":
            raise StudyError(f"animate=True takes a result of kinematics, not of {self.command}")
        if not plots and (animate or formats is not None):
            raise StudyError("plots=False and animate=True or formats contradict each other")
        output = Extras(plots, formats_of(formats, "formats"), animate, self.all_modes)
        folder = Path(directory)
        check_folder(folder, self.command, output, read_by(self.study))
        with owned(folder):
            undrawn = writer.write(folder, self.study, self, self.verdicts, output)
        for warning in undrawn:
            warnings.warn(str(warning), stacklevel=2)
        return folder

    def __repr__(self) -> str:
        lines = [f"<{self.command} of {shown(self.study.name)}: {QUESTIONS[self.command].question}"]
        lines.append(", ".join(f"{name} ({counted(len(table), 'row')})" for name, table in self.tables.items()))
        judged = self._judged()
        if isinstance(judged, str):
            lines.append(f"requirements: {judged}")
        elif judged:
            met = sum(verdict.met for verdict in judged)
            lines.append(f"{met} of {counted(len(judged), 'requirement')} met")
        lines += [text for text in (self.interrupted, self.failed, *self.notes) if text]
        lines.append(counted(len(self.warnings), "warning") if self.warnings else "no warnings")
        return "\n  ".join(lines) + ">"

    def _repr_html_(self) -> str:
        from mechdesign.door.api.html import answer_html

        return answer_html(self.study, self, self._judged(), *self._gallery)

    def _repr_png_(self) -> bytes | None:
        return self._gallery[1]

    def _judged(self) -> tuple[Verdict, ...] | str:
        """The verdicts, or why there are none: what shows a result must not fail."""
        try:
            return self.verdicts
        except MechdesignError as error:
            return str(error)

    @cached_property
    def _gallery(self) -> tuple[tuple[str, ...], bytes | None]:
        """Names of its pictures, and the first of them as a PNG; None where there is none."""
        from mechdesign.drawing import style

        drawn = self._drawn()
        for name, why in drawn.failed.items():
            _undrawn(name, why)
        for name, figure in drawn.items():
            try:
                with style.context():
                    return tuple(drawn), style.encoded(figure)
            except Exception as error:
                _undrawn(name, explain(error)[1])
        return tuple(drawn), None

    def _drawn(self, name: str | None = None) -> Gallery:
        """All its pictures, and last the mechanism, or that of one name; none of an interrupted computation."""
        from mechdesign.drawing import style
        from mechdesign.drawing.fonts import lost_letters
        from mechdesign.drawing.mechanism import mechanism_picture
        from mechdesign.drawing.pictures import figures
        from mechdesign.drawing.rendering import Gallery

        if self.interrupted:
            return Gallery()
        with style.context():
            drawn = figures(self.study, self, name=name)
            whose = self.whose(self.study)
            if name in (None, MECHANISM) and not whose.is_task:
                drawn.add(MECHANISM, mechanism_picture, whose, self.seen)
        if why := lost_letters(str(self.study.resolved)):
            warnings.warn(why, stacklevel=2)
        return drawn


def _undrawn(name: str, why: str) -> None:
    """Say that a picture could not be drawn."""
    warnings.warn(f"picture {name} could not be drawn: {why}", stacklevel=2)

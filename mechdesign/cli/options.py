"""The options of the commands, each said once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mechdesign.errors import StudyError

StudyArgument = Annotated[
    Path | None,
    typer.Argument(
        metavar="STUDY",
        help="The study file. Left out: study.yaml here, or else the built-in two-link arm.",
        show_default=False,
    ),
]
StudiesArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="STUDY...",
        help="The study files. Left out: study.yaml here, or else the built-in two-link arm.",
        show_default=False,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder for tables, pictures and manifest. Default: results/<study>/<command>.",
        show_default=False,
    ),
]
OutAll = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder that gets one folder a command (several studies: <study>/<command>). Default: results/<study>.",
        show_default=False,
    ),
]
OutDrawings = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder for the drawing (several studies: <study>/ in it). Default: results/<study>/check.",
        show_default=False,
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="A.B.C=VALUE",
        help="Change one entry of the study before it is checked, e.g. mechanism.parameters.r=42. Repeatable.",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(
        "--seed",
        metavar="N",
        min=0,
        help="Seed of the random numbers. Default: the study's, else 0.",
        show_default=False,
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        metavar="N",
        min=1,
        help="Threads to compute on; the results do not depend on it. Default: every processor.",
        show_default=False,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the main table to stdout as JSON.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but the results and what went wrong.")]
NoPlots = Annotated[bool, typer.Option("--no-plots", help="Draw no pictures.")]
Animate = Annotated[bool, typer.Option("--animate", help="Also draw the motion of a sweep or path: motion.gif.")]
AllModes = Annotated[
    bool, typer.Option("--all-modes", help="Follow every way in which the mechanism can be assembled: modes.csv.")
]
Junit = Annotated[
    Path | None,
    typer.Option("--junit", metavar="FILE", help="Also write the outcome as JUnit XML, for CI.", show_default=False),
]
FailFast = Annotated[bool, typer.Option("--fail-fast", help="Stop at the first question that fails.")]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Skip questions whose results are there, whole, from the same study and seed; go on with unfinished ones.",
    ),
]

ResumeDesigns = Annotated[
    bool, typer.Option("--resume", help="Go on with what an interrupted run of the same study and seed had finished.")
]


@dataclass(frozen=True)
class Options:
    """What the options of a command say.

    Parameters
    ----------
    out : Path or None
        Folder for the results; None is ``results/<study>/<command>``.

    Raises
    ------
    StudyError
        If two options contradict each other.
    """

    out: Path | None = None
    overrides: tuple[str, ...] = ()
    seed: int | None = None
    jobs: int | None = None
    json: bool = False
    quiet: bool = False
    plots: bool = True
    animate: bool = False
    all_modes: bool = False
    fail_fast: bool = False
    resume: bool = False

    def __post_init__(self) -> None:
        if self.animate and not self.plots:
            raise StudyError("--animate and --no-plots contradict each other")

"""Where the results of a command go, and what stands there already."""

from __future__ import annotations

import os
from pathlib import Path

from mechdesign.cli.options import STYLES, Options
from mechdesign.commands import SWEEP
from mechdesign.errors import StudyError
from mechdesign.files import check_marked
from mechdesign.report import manifest
from mechdesign.report.manifest import Extras
from mechdesign.report.page import pages
from mechdesign.study import Study
from mechdesign.work import shards
from mechdesign.work.journal import MARK, NAME

PAGE = pages.GENERATOR.encode()  # by which a report is known
RESULTS = Path("results")  # where no other folder is asked for
# Names of files about several studies, beside their folders.
SUMMARY = "summary.csv"
_SHARED = (SUMMARY, pages.INDEX)
# Commands that an interrupted run need not begin anew.
RESUMED = ("optimize", SWEEP.name)


def folder(study: Study, name: str, options: Options, *, several: bool = False) -> Path:
    """Where the results of a command go, given alone; of several studies each has a folder in that of the option."""
    if options.out is None:
        return RESULTS / study.label / name
    return options.out / study.label if several else options.out


def place(directory: Path, options: Options) -> Path:
    """The folder that a command writes in: of a shard its own, for others write at the same time."""
    return directory if options.part is None else directory / options.part.folder


def claim(owners: dict[str, Path | None], study: Study) -> None:
    """Take the folder of a study's name; `owners` says which file each folder belongs to.

    Raises
    ------
    StudyError
        If another file of that name has it.
    """
    if study.label in _SHARED:
        raise StudyError(f"{study.path}: its folder of results would have the name of a file of all; rename the study")
    owner = owners.setdefault(study.label, study.path)
    if owner != study.path:
        raise StudyError(f"{study.path}: its results would overwrite those of {owner}; rename one of the files")


def extras(command: str, options: Options) -> Extras:
    """What else than tables the options want of a command."""
    animate = options.animate and command == "kinematics"
    look = options.style or STYLES[0]
    return Extras(not options.no_plots, options.kinds, animate, options.all_modes, options.report, look)


def check(study: Study, command: str, directory: Path, options: Options) -> None:
    """Find out before a command computes that its files would replace others than its own, or what the study reads.

    Raises
    ------
    StudyError
        If they would; it names the file.
    OutputError
        If the folder takes no files.
    """
    if options.part is not None:
        check_marked(directory / shards.FILE, shards.MARK)
        return
    manifest.check_folder(directory, study, command, extras(command, options))
    for part in shards.found(directory) if os.path.isdir(directory) else ():
        check_marked(part, shards.MARK)
    if command in RESUMED:
        check_marked(directory / NAME, MARK)
    if options.report:
        check_marked(directory / pages.REPORT, PAGE)

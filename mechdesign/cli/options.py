"""The options of the commands, each said once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from inspect import Parameter
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mechdesign.commands import MAX_JOBS, QUESTIONS, SWEEP
from mechdesign.errors import StudyError
from mechdesign.files import FORMATS, formats_of

if TYPE_CHECKING:
    from mechdesign.work.shards import Shard

# Kinds of reports.
HTML, PDF = "html", "pdf"
_REPORT = "--report"
# Styles of pictures: width of the page and size of the type.
STYLES = ("screen", "paper")
# Default relative tolerance of `compare`: above the rounding differences between machines, below any real change.
RELATIVE = 1e-9
# Options that fill fields of other names.
_FIELDS = {"--set": "overrides", "--format": "formats"}


def _studies(incomplete: str) -> list[str]:
    """Study files that complete a word; where there are none the shell completes names of folders."""
    folder, slash, start = incomplete.rpartition("/")
    try:
        names = sorted(path.name for path in Path(folder + slash).glob("*.yaml"))
    except OSError:
        return []
    return [f"{folder}{slash}{name}" for name in names if name.startswith(start)]


def _templates(incomplete: str) -> list[str]:
    folder = Path(__file__).parents[1] / "study" / "templates"
    return sorted(path.stem for path in folder.glob("*.yaml") if path.stem.startswith(incomplete))


def _one_of(words: Iterable[str]) -> Callable[[str], list[str]]:
    """A completion to one of these words."""
    return lambda incomplete: [word for word in words if word.startswith(incomplete)]


def _parameter(name: str, kind: Any, default: Any, meaning: Any) -> Parameter:
    annotated: Any = Annotated
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotated[kind, meaning])


def _study(name: str, kind: Any, metavar: str, meaning: str) -> Parameter:
    argument = typer.Argument(metavar=metavar, help=meaning, show_default=False, autocompletion=_studies)
    return _parameter(name, kind | None, None, argument)


def _name(flag: str) -> str:
    """The field of `Options` that an option fills."""
    return _FIELDS.get(flag, flag.removeprefix("--").replace("-", "_"))


def _text(kind: Any, flag: str, metavar: str, meaning: str, **more: Any) -> Parameter:
    option = typer.Option(flag, metavar=metavar, help=meaning, show_default=False, **more)
    return _parameter(_name(flag), kind | None, None, option)


def _flag(flag: str, meaning: str, *short: str) -> Parameter:
    return _parameter(_name(flag), bool, False, typer.Option(flag, *short, help=meaning))


def _report(meaning: str) -> Parameter:
    return _text(str, _REPORT, "[pdf]", meaning, autocompletion=_one_of([PDF]))


def with_kinds(words: Sequence[str]) -> list[str]:
    """Words of a command line with the kind of the report after a `--report` that stands alone."""
    filled = []
    for word, follower in zip_longest(words, words[1:]):
        filled.append(word)
        if word == _REPORT and follower not in (HTML, PDF):
            filled.append(HTML)
    return filled


def _out(meaning: str) -> Parameter:
    return _text(Path, "--out", "DIR", meaning)


STUDY = _study(
    "path",
    Path,
    "STUDY",
    "The study file; - is standard input. Left out: study.yaml here, or else the built-in two-link arm.",
)
STUDIES = _study(
    "paths",
    list[Path],
    "STUDY...",
    "The study files, folders of them (*.yaml, *.yml) or patterns; - is standard input. Left out: study.yaml here.",
)
OUT = _out("Folder for tables, pictures and manifest. Default: results/<study>/<command>.")
OUT_ALL = _out(
    "Folder that gets one folder a command (several studies: <study>/<command>, summary.csv). Default: results/<study>."
)
OUT_DRAWINGS = _out("Folder for the drawing (several studies: <study>/ in it). Default: results/<study>/check.")
OUT_EXPORT = _text(Path, "--out", "PATH", "The file, or a folder for it. Default: results/<study>/export.")
TO = _parameter(
    "to",
    str,
    Parameter.empty,
    typer.Option("--to", metavar="NAME", help="Name of the file, e.g. parts.dxf; a wrong name lists them."),
)
RATE = _text(
    str,
    "--rate",
    "RATE",
    "Rate at which motion.csv tells the drives, e.g. '500 Hz', or a step of time, e.g. '2 ms'. Default: 1 kHz.",
)
PAPER = _text(
    str,
    "--paper",
    "SIZE",
    "Size of the drawing sheet sheet.pdf: A4 or A3. Default: A4, or A3 where the drawing would be crowded.",
)
AT = _text(
    str,
    "--at",
    "POSE",
    "Pose in which the mechanism is shown, e.g. theta=60 or 'theta1=30, theta2=1 rad'. Default: that of the sketch.",
)
OVERRIDES = _text(
    list[str],
    "--set",
    "A.B.C=VALUE",
    "Change one entry of the study before it is checked, e.g. mechanism.parameters.r=42. Repeatable.",
)
SEED = _text(int, "--seed", "N", "Seed of the random numbers. Default: the study's, else 0.", min=0)
JOBS = _text(
    int,
    "--jobs",
    "N",
    "Processes to compute on, or studies at a time; the results do not depend on it. Default: one for each processor.",
    min=1,
    max=MAX_JOBS,
)
EXECUTOR = _text(
    str,
    "--executor",
    "NAME",
    "Where long computations run: dask:tcp://HOST:PORT, dask:local, or module:factory, a function that gives a "
    "concurrent.futures.Executor. The results do not depend on it. Default: here.",
)
SHARD = _text(
    str,
    "--shard",
    "I/N",
    "Only the I-th of N parts, I from 1 on: of `run` every N-th study, of `sweep` every N-th batch of cases, kept in "
    "the folder of the results; `mechdesign merge` puts the parts together.",
)
JSON = _flag("--json", "Print the main table to stdout as JSON.")
QUIET = _flag("--quiet", "Say nothing but the results and what went wrong.", "-q")
NO_PLOTS = _flag(
    "--no-plots", "Draw no pictures; those of a run before are removed, as they would not fit the new tables."
)
FORMAT = _text(
    str, "--format", "LIST", "Formats of the pictures, e.g. png,svg,pdf. Default: png.", autocompletion=_one_of(FORMATS)
)
STYLE = _text(
    str,
    "--style",
    "NAME",
    "Of the pictures: screen, or paper for a journal's column, 88 mm wide with type of 8 pt. Default: screen.",
    autocompletion=_one_of(STYLES),
)
ANIMATE = _flag("--animate", "Also draw the motion of a sweep or path: motion.gif.")
REPORT = _report("Also write report.html: one page with all of it, which moves; pdf: report.pdf as well.")
REPORTS = _report(
    "Also write report.html, a page a study with all of it;"
    " pdf: report.pdf as well; of several studies also index.html."
)
ALLOW_FILES = _flag("--allow-files", "Also read files that the study names and that lie outside its folder.")
ALL_MODES = _flag("--all-modes", "Follow every way in which the mechanism can be assembled: modes.csv.")
BEFORE = _text(
    Path,
    "--before",
    "STUDY",
    "Also draw this study, without the overrides of --set, in dashes under the other: before and after a change.",
    autocompletion=_studies,
)
JUNIT = _text(Path, "--junit", "FILE", "Also write the outcome as JUnit XML, for CI.")
FAIL_FAST = _flag("--fail-fast", "Stop at the first question that fails.")
STRICT = _flag("--strict", "Every warning fails, as with fail_on: all in the study: exit code 1.")
RESUME = _flag(
    "--resume",
    "Skip questions whose results are there, whole, from the same study and seed; go on with unfinished ones.",
)
RESUME_DESIGNS = _flag("--resume", "Go on with what an interrupted run of the same study and seed had finished.")
VARY = _text(
    list[str],
    "--vary",
    "A.B.C=VALUES",
    "An entry of the study that varies, and its values: START:STOP:STEP, VALUE,VALUE,... (also words), or LOW:HIGH of "
    "a random design, e.g. mechanism.parameters.r=30:50:5. Repeatable; in place of what the study's matrix varies.",
)
METHOD = _text(str, "--method", "NAME", "Which combinations are cases: grid, latin_hypercube or sobol. Default: grid.")
SAMPLES = _text(int, "--samples", "N", "Number of cases of latin_hypercube and sobol.", min=1)
CASES = _text(
    Path,
    "--cases",
    "FILE",
    "CSV file of cases instead of --vary: its first line names entries of the study, each line below is a case.",
)
RESULTS = _text(
    list[str],
    "--results",
    "LIST",
    "Results that are listed besides the requirements, with commas between, e.g. kinematics.mu.min,GII. Repeatable; in "
    "place of those of the study's matrix.",
)
MAXIMIZE = _text(
    list[str],
    "--maximize",
    "LIST",
    "Results that are to be large: cases that meet every requirement get a rank, and the Pareto front is marked. Named "
    "as for --results. Repeatable; in place of what the study's matrix maximizes.",
)
MINIMIZE = _text(list[str], "--minimize", "LIST", "Results that are to be small, likewise.")
SORT = _flag("--sort", "The best case is the first row of the table.")
VERIFY = _text(
    Path,
    "--verify",
    "PATH",
    "Instead of studies: repeat what a manifest.json, or those in a folder, say was computed, and compare the bytes of "
    "the tables; 1 where they are others. Files that a study names are looked for beside it, else beside the manifest.",
)


def _folder(name: str, meaning: str) -> Parameter:
    return _parameter(name, Path, Parameter.empty, typer.Argument(metavar=name.upper(), help=meaning))


FILE = _parameter(
    "path", Path, Parameter.empty, typer.Argument(metavar="STUDY", help="The study file.", autocompletion=_studies)
)
COMMANDS = _parameter(
    "commands",
    list[str] | None,
    None,
    typer.Argument(
        metavar="[COMMAND]...",
        help="Questions; left out: all that the study asks.",
        show_default=False,
        autocompletion=_one_of(QUESTIONS),
    ),
)
TEMPLATE = typer.Argument(
    metavar="[TEMPLATE]",
    help="Name of a template; a wrong name lists them.",
    show_default=False,
    autocompletion=_templates,
)
SOURCE = typer.Argument(
    metavar="SOURCE",
    help="A share address of PMKS+ (in quotes), a file, or a folder with joints.csv and links.csv.",
    show_default=False,
)
OUT_STUDY = typer.Option(
    "--out", metavar="FILE", help="Where to write the study. Left out: stdout.", show_default=False
)
DRIVE = typer.Option(
    "--drive",
    metavar="NAME",
    help="What is driven, in place of the file's inputs: a pin of two links, a link or a slide; may be repeated.",
    show_default=False,
)
UNIT = typer.Option("--unit", metavar="UNIT", help="Unit of length in place of the file's.", show_default=False)
SCALE = typer.Option("--scale", metavar="FACTOR", help="Factor of all lengths.", show_default=False)
OLD = _folder("old", "Folder of the results that are the baseline.")
NEW = _folder("new", "Folder of the results that are compared with it.")
RTOL = _parameter(
    "rtol",
    float,
    RELATIVE,
    typer.Option("--rtol", metavar="R", min=0, help="Relative tolerance: a share of the old number."),
)
ATOL = _text(
    float,
    "--atol",
    "A",
    "Absolute tolerance, which is added. Default: what rounding leaves, 1e-12 of the largest number of the same unit "
    "in the table.",
    min=0,
)
# Options that make the cases of a sweep.
MATRIX = (VARY, METHOD, SAMPLES, CASES, RESULTS, MAXIMIZE, MINIMIZE, SORT)
# Options of every question, and those of single questions.
COMMON = (STUDY, OUT, OVERRIDES, SEED, JOBS, JSON, QUIET, STRICT, NO_PLOTS, FORMAT, STYLE, ALLOW_FILES)
OWN = {
    "kinematics": (ANIMATE, ALL_MODES, BEFORE),
    "workspace": (BEFORE,),
    "optimize": (RESUME_DESIGNS, EXECUTOR),
    "reliability": (EXECUTOR,),
    "sensitivities": (EXECUTOR,),
}


@dataclass(frozen=True)
class Options:
    """Values of the options of a command.

    Raises
    ------
    StudyError
        If two options contradict each other, or a format or style is none.
    """

    out: Path | None = None
    overrides: tuple[str, ...] | None = ()
    seed: int | None = None
    jobs: int | None = None
    executor: str | None = None
    shard: str | None = None
    command: str = ""  # name of the command
    json: bool = False
    quiet: bool = False
    no_plots: bool = False
    formats: str | None = None
    style: str | None = None
    report: str | None = None  # `HTML`, or `PDF` for both
    animate: bool = False
    all_modes: bool = False
    before: Path | None = None
    junit: Path | None = None
    fail_fast: bool = False
    strict: bool = False
    resume: bool = False
    verify: Path | None = None
    allow_files: bool = False

    def __post_init__(self) -> None:
        if self.animate and self.no_plots:
            raise StudyError("--animate and --no-plots contradict each other")
        for option, value in (("--format", self.formats), ("--style", self.style), ("--before", self.before)):
            if value is not None and self.no_plots:
                raise StudyError(f"{option} and --no-plots contradict each other")
        if self.shard is not None and self.report and self.command == SWEEP.name:
            raise StudyError("--shard and --report contradict each other; merge takes --report")
        if self.report not in (None, HTML, PDF):
            raise StudyError(f"--report takes {PDF} or nothing, not {self.report!r}")
        if self.report == PDF:
            from mechdesign.report.page.printing import browser

            # Told before anything is computed.
            browser()
        if self.style is not None and self.style not in STYLES:
            raise StudyError(f"--style takes {' or '.join(STYLES)}, not {self.style!r}")
        formats_of(self.formats, "--format")

    @property
    def part(self) -> Shard | None:
        """The shard to compute; None without --shard."""
        from mechdesign.work.shards import Shard

        return None if self.shard is None else Shard.of(self.shard)

    @property
    def kinds(self) -> str:
        """Formats of the pictures, with commas between them."""
        return formats_of(self.formats, "--format")

"""What commands take: every argument and option, said once. Annotations are read at start, so they are no texts."""

import dataclasses
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from inspect import Parameter
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from mechdesign.commands import MAX_JOBS, MERGE, QUESTIONS, SWEEP
from mechdesign.ground.docstrings import key_texts
from mechdesign.ground.errors import StudyError
from mechdesign.ground.files import FORMATS, formats_of

if TYPE_CHECKING:
    from mechdesign.ground.work.shards import Shard

# Kinds of reports.
HTML, PDF = "html", "pdf"
_REPORT = "--report"
# Styles of pictures: width of the page and size of the type.
STYLES = ("screen", "paper")
# Default relative tolerance of `compare`: above the rounding differences between machines, below any real change.
RELATIVE = 1e-9
# Options whose fields have other names.
_FLAGS = {"overrides": "--set", "formats": "--format"}


def _studies(incomplete: str) -> list[str]:
    """Study files that complete a word; where there are none the shell completes names of folders."""
    end = max(incomplete.rfind(slash) for slash in ("/", os.sep)) + 1
    folder, start = incomplete[:end], incomplete[end:]
    try:
        names = sorted(path.name for path in Path(folder).glob("*.yaml"))
    except OSError:
        return []
    return [folder + name for name in names if name.startswith(start)]


def _paths(incomplete: str) -> list[str]:
    """Entries of a study that complete a word: keys of the format, and names of the study that is typed."""
    from mechdesign.door.reference.keys import continued
    from mechdesign.study.text.document import read

    # What is typed, as bash gives it, or another shell.
    line = os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS", "")
    study = next((word for word in line.split() if word.endswith((".yaml", ".yml"))), "study.yaml")
    try:
        data = read(Path(study).read_bytes(), study).data
    except (OSError, StudyError):
        data = None
    return continued(incomplete, data)


def _templates(incomplete: str) -> list[str]:
    package = Path(__file__).parents[2]
    shipped = next(filter(Path.is_dir, (package / "pages" / "configs", package.parent / "configs")), package)
    files = (*(package / "study" / "templates").glob("*.yaml"), *shipped.rglob("*.yaml"))
    return sorted({path.stem for path in files if path.stem.startswith(incomplete)})


def _one_of(words: Iterable[str]) -> Callable[[str], list[str]]:
    """A completion to one of these words."""
    return lambda incomplete: [word for word in words if word.startswith(incomplete)]


# Typer's description of an argument or option, from its flag and its help.
_Description = Callable[[str, str], Any]


def _argument(metavar: str, **more: Any) -> _Description:
    return lambda flag, meaning: typer.Argument(metavar=metavar, help=meaning, show_default=False, **more)


def _option(metavar: str, **more: Any) -> _Description:
    more = {"show_default": False} | more
    return lambda flag, meaning: typer.Option(flag, metavar=metavar, help=meaning, **more)


def _flag(*short: str) -> _Description:
    return lambda flag, meaning: typer.Option(flag, *short, help=meaning)


@dataclass(frozen=True)
class Options:
    """Values of the arguments and options of a command; the docstring under each is its help.

    Raises
    ------
    StudyError
        If two options contradict each other, or a format or style is none.
    """

    command: str = ""
    path: Annotated[Path | None, _argument("STUDY", autocompletion=_studies)] = None
    """The study file; - is standard input. Left out: study.yaml here, or else the built-in two-link arm."""
    paths: Annotated[list[Path] | None, _argument("STUDY...", autocompletion=_studies)] = None
    """The study files, folders of them (*.yaml, *.yml) or patterns; - is standard input. Left out: study.yaml here."""
    commands: Annotated[list[str] | None, _argument("[COMMAND]...", autocompletion=_one_of(QUESTIONS))] = None
    """Questions; left out: all that the study asks."""
    template: Annotated[str | None, _argument("[TEMPLATE]", autocompletion=_templates)] = None
    """Name of a template, or of a shipped study such as cam_dwell; a wrong name lists the templates."""
    source: Annotated[str, _argument("SOURCE")] = ""
    """A share address of PMKS+ (in quotes), a file, or a folder with joints.csv and links.csv."""
    old: Annotated[Path, _argument("OLD")] = Path()
    """Folder of the results that are the baseline."""
    new: Annotated[Path, _argument("NEW")] = Path()
    """Folder of the results that are compared with it."""
    to: Annotated[str, _option("NAME")] = ""
    """Name of the file, e.g. parts.dxf; a wrong name lists them."""
    at: Annotated[str | None, _option("POSE")] = None
    """Pose in which the mechanism is shown, e.g. theta=60 or 'theta1=30, theta2=1 rad'. Default: that of the sketch."""
    rate: Annotated[str | None, _option("RATE")] = None
    """Rate at which motion.csv tells the drives, e.g. '500 Hz', or a step of time, e.g. '2 ms'. Default: 1 kHz."""
    paper: Annotated[str | None, _option("SIZE")] = None
    """Size of the drawing sheet sheet.pdf: A4 or A3. Default: A4, or A3 where the drawing would be crowded."""
    out: Annotated[Path | None, _option("DIR")] = None
    """Folder for tables, pictures and manifest. Default: results/<study>/<command>."""
    drive: Annotated[list[str] | None, _option("NAME")] = None
    """What is driven, in place of the file's inputs: a pin of two links, a link or a slide; may be repeated."""
    unit: Annotated[str | None, _option("UNIT")] = None
    """Unit of length in place of the file's."""
    scale: Annotated[float | None, _option("FACTOR")] = None
    """Factor of all lengths."""
    rtol: Annotated[float, _option("R", min=0, show_default=True)] = RELATIVE
    """Relative tolerance: a share of the old number."""
    atol: Annotated[float | None, _option("A", min=0)] = None
    """Absolute tolerance, which is added. Default: what rounding leaves, 1e-12 of the largest number of the same unit
    in the table.
    """
    vary: Annotated[list[str] | None, _option("A.B.C=VALUES", autocompletion=_paths)] = None
    """An entry of the study that varies, and its values: START:STOP:STEP, VALUE,VALUE,... (also words), or LOW:HIGH of
    a random design, e.g. mechanism.parameters.r=30:50:5. Repeatable; in place of what the study's matrix varies.
    """
    method: Annotated[str | None, _option("NAME")] = None
    """Which combinations are cases: grid, latin_hypercube or sobol. Default: grid."""
    samples: Annotated[int | None, _option("N", min=1)] = None
    """Number of cases of latin_hypercube and sobol."""
    cases: Annotated[Path | None, _option("FILE")] = None
    """CSV file of cases instead of --vary: its first line names entries of the study, each line below is a case."""
    results: Annotated[list[str] | None, _option("LIST")] = None
    """Results that are listed besides the requirements, with commas between, e.g. kinematics.mu.min,GII. Repeatable; in
    place of those of the study's matrix.
    """
    maximize: Annotated[list[str] | None, _option("LIST")] = None
    """Results that are to be large: cases that meet every requirement get a rank, and the Pareto front is marked. Named
    as for --results. Repeatable; in place of what the study's matrix maximizes.
    """
    minimize: Annotated[list[str] | None, _option("LIST")] = None
    """Results that are to be small, likewise."""
    sort: bool = False
    """The best case is the first row of the table."""
    overrides: Annotated[list[str] | None, _option("A.B.C=VALUE", autocompletion=_paths)] = None
    """Change one entry of the study before it is checked, e.g. mechanism.parameters.r=42. Repeatable."""
    seed: Annotated[int | None, _option("N", min=0)] = None
    """Seed of the random numbers. Default: the study's, else 0."""
    jobs: Annotated[int | None, _option("N", min=1, max=MAX_JOBS)] = None
    """Processes to compute on, or studies at a time; the results do not depend on it. Default: one for each processor.
    """
    json: bool = False
    """Print the main table to stdout as JSON."""
    quiet: Annotated[bool, _flag("-q")] = False
    """Say nothing but the results and what went wrong."""
    strict: bool = False
    """Every warning fails, as with fail_on: all in the study: exit code 1."""
    no_plots: bool = False
    """Draw no pictures; those of a run before are removed, as they would not fit the new tables."""
    formats: Annotated[str | None, _option("LIST", autocompletion=_one_of(FORMATS))] = None
    """Formats of the pictures, e.g. png,svg,pdf. Default: png."""
    style: Annotated[str | None, _option("NAME", autocompletion=_one_of(STYLES))] = None
    """Of the pictures: screen, or paper for a journal's column, 88 mm wide with type of 8 pt. Default: screen."""
    allow_files: bool = False
    """Also read files that the study names and that lie outside its folder."""
    report: Annotated[str | None, _option("[pdf]", autocompletion=_one_of([PDF]))] = None
    """Also write report.html: one page with all of it, which moves; pdf: report.pdf as well."""
    animate: bool = False
    """Also draw the motion of a sweep or path: motion.gif."""
    all_modes: bool = False
    """Follow every way in which the mechanism can be assembled: modes.csv."""
    before: Annotated[Path | None, _option("STUDY", autocompletion=_studies)] = None
    """Also draw this study, without the overrides of --set, in dashes under the other: before and after a change."""
    junit: Annotated[Path | None, _option("FILE")] = None
    """Also write the outcome as JUnit XML, for CI."""
    fail_fast: bool = False
    """Stop at the first question that fails."""
    resume: bool = False
    """Go on with what an interrupted run of the same study and seed had finished."""
    verify: Annotated[Path | None, _option("PATH")] = None
    """Instead of studies: repeat what a manifest.json, or those in a folder, say was computed, and compare the bytes of
    the tables; 1 where they are others. Files that a study names are looked for beside it, else beside the manifest.
    """
    port: Annotated[int | None, _option("N", min=1, max=65535)] = None
    """Port of this machine at which the page is. Default: a free one."""
    no_browser: bool = False
    """Open no browser; the address is told."""
    executor: Annotated[str | None, _option("NAME")] = None
    """Where long computations run: dask:tcp://HOST:PORT, dask:local, or module:factory, a function that gives a
    concurrent.futures.Executor. The results do not depend on it. Default: here.
    """
    shard: Annotated[str | None, _option("I/N")] = None
    """Only the I-th of N parts, I from 1 on: of `run` every N-th study, of `sweep` every N-th batch of cases, kept in
    the folder of the results; `mechdesign merge` puts the parts together.
    """

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
            from mechdesign.door.report.page.printing import browser

            # Told before anything is computed.
            browser()
        if self.style is not None and self.style not in STYLES:
            raise StudyError(f"--style takes {' or '.join(STYLES)}, not {self.style!r}")
        formats_of(self.formats, "--format")

    @property
    def part(self) -> "Shard | None":
        """The shard to compute; None without --shard."""
        from mechdesign.ground.work.shards import Shard

        return None if self.shard is None else Shard.of(self.shard)

    @property
    def kinds(self) -> str:
        """Formats of the pictures, with commas between them."""
        return formats_of(self.formats, "--format")


# Help where a command means something of its own.
_OF_ALL = (
    "Folder that gets one folder a command (several studies: <study>/<command>, summary.csv). Default: results/<study>."
)
_OF_MANY = {
    "out": _OF_ALL,
    "report": "Also write report.html, a page a study with all of it; pdf: report.pdf as well; of several studies also "
    "index.html.",
    "resume": "Skip questions whose results are there, whole, from the same study and seed; go on with unfinished "
    "ones.",
}
_MEANINGS: Mapping[str, Mapping[str, str]] = {
    "run": _OF_MANY,
    MERGE: _OF_MANY,
    "watch": {"path": "The study file.", "out": _OF_ALL},
    "live": {"path": "The study file."},
    "check": {"out": "Folder for the drawing (several studies: <study>/ in it). Default: results/<study>/check."},
    "export": {"out": "The file, or a folder for it. Default: results/<study>/export."},
    "import": {"out": "Where to write the study. Left out: stdout."},
}
_METAVARS = {"export": {"out": "PATH"}, "import": {"out": "FILE"}}


def parameters(command: str, names: str) -> Iterator[Parameter]:
    """What a command takes: fields of `Options`, one behind the other; ``!`` follows those that may not be left out."""
    fields = {field.name: field for field in dataclasses.fields(Options)}
    texts, own = key_texts(__name__), _MEANINGS.get(command, {})
    for word in names.split():
        name = word.rstrip("!")
        field, flag = fields[name], _FLAGS.get(name, f"--{name.replace('_', '-')}")
        kind, describe = get_args(field.type) or (field.type, _flag())
        described = describe(flag, own.get(name, texts["Options", name].text))
        described.metavar = _METAVARS.get(command, {}).get(name, described.metavar)
        default = Parameter.empty if word != name else field.default
        annotated: Any = Annotated
        yield Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotated[kind, described])


def with_kinds(words: Sequence[str]) -> list[str]:
    """Words of a command line with the kind of the report after a `--report` that stands alone."""
    filled = []
    for word, follower in zip_longest(words, words[1:]):
        filled.append(word)
        if word == _REPORT and follower not in (HTML, PDF):
            filled.append(HTML)
    return filled

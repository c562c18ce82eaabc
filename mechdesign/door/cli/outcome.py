"""What became of a command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from mechdesign.door.report import manifest
from mechdesign.door.report.requirements import Verdict
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import OUTCOMES
from mechdesign.ground.files import FORMATS
from mechdesign.ground.results import Result, Table


@dataclass(frozen=True)
class Outcome:
    """The outcome of one command; `rows` are those of the main table."""

    study: str
    command: str
    directory: Path
    exit_code: int
    rows: int
    warnings: Sequence[Caution] = ()
    failed: str = ""
    verdicts: Sequence[Verdict] = ()
    seconds: float = 0.0
    kept: bool = False
    written: bool = False  # whether the results are in the directory
    table: Table | None = None  # the main table
    closing: Sequence[str] = ()  # what is told last, in words
    shard: str = ""  # what became of the shard, with --shard
    left: bool = False  # whether the run ended before this question
    reached: bool = True  # False if an allocation did not reach its reliability although all poses assemble

    @classmethod
    def unanswered(
        cls, study: str, command: str, directory: Path, exit_code: int, error: BaseException, words: str
    ) -> Self:
        """That of a question which ended with an error; a part of an answer, or the nearest one, may be written."""
        result: Result | None = getattr(error, "result", None)
        words = (result.failed if result is not None else "") or words
        return cls(study, command, directory, exit_code, 0, failed=words, written=result is not None)

    @property
    def picture(self) -> Path | None:
        """The most telling of its pictures; None where there is none."""
        content = manifest.read(self.directory) if self.written else None
        files = manifest.recorded_files(content) if content is not None else {}
        # The pictures of a question are listed in their order, which begins with the most telling.
        return next((self.directory / name for name in files if name.rpartition(".")[2] in FORMATS), None)

    @property
    def word(self) -> str:
        """The outcome in a word or two."""
        return OUTCOMES[self.exit_code] if self.reached else "not reached"

"""The part of the page of limits that says what the tool tells, from docs/limits.yaml."""

from __future__ import annotations

import shlex
import textwrap
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

DATA = Path(__file__).parent / "limits.yaml"
CONFIGS = Path(__file__).parents[1] / "configs"
NOTHING = "nothing"


@dataclass(frozen=True)
class Limit:
    """A limit of validity, the study that passes it, and what the command says."""

    limit: str
    study: str
    ask: str
    says: str
    adds: str = ""
    set: tuple[str, ...] = ()
    kind: str = ""
    code: int = 0

    @property
    def shipped(self) -> bool:
        """Whether the study is one of configs/."""
        return self.study.endswith(".yaml")

    @property
    def text(self) -> str:
        """The study."""
        written = (CONFIGS / self.study).read_text(encoding="utf-8") if self.shipped else snippets()[self.study]
        return f"{written}{self.adds.rstrip()}\n" if self.adds else written

    def command(self, study: str) -> list[str]:
        """The words of the command about a study."""
        return [self.ask, study, *(word for change in self.set for word in ("--set", change))]

    @property
    def told(self) -> str:
        """What the command says, as Markdown."""
        if self.says == NOTHING:
            return "The tool says nothing of it."
        place = f" (`{self.kind}`)" if self.kind else ""
        end = f", exit code {self.code}" if self.code else ""
        return f"`{self.says}`{place}{end}"

    @property
    def shown(self) -> str:
        """The study and the command that show it, folded."""
        name = f"configs/{self.study}" if self.shipped else "study.yaml"
        block = "" if self.shipped else f"```YAML\n{self.text}```\n\n"
        command = f"```text\nmechdesign {shlex.join(self.command(name))}\n```"
        return f"<details>\n<summary>shown by</summary>\n\n{block}{command}\n\n</details>"


@cache
def _data() -> dict[str, Any]:
    return dict(yaml.safe_load(DATA.read_text(encoding="utf-8")))


def snippets() -> dict[str, str]:
    """Studies that several limits begin with, by name."""
    return dict(_data()["studies"])


def limits() -> dict[str, list[Limit]]:
    """All limits by what they are about."""
    return {about: [Limit(**{**entry, "set": tuple(entry.get("set", ()))}) for entry in entries]
            for about, entries in _data()["limits"].items()}  # fmt: skip


def pages() -> dict[str, str]:
    """What the page of limits includes, by its path in the folder of the site."""
    parts = []
    for about, entries in limits().items():
        parts.append(f"### {about}: what it says\n")
        parts += [f"{entry.limit}\n: {entry.told}\n\n{textwrap.indent(entry.shown, '  ')}\n" for entry in entries]
    return {"theory/_limits.md": "\n".join(parts)}

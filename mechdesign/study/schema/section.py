"""The section of a study that a command answers."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from mechdesign.study.text import fields


class Section(fields.Model):
    """What a study asks of a command."""

    command: ClassVar[str]

    @classmethod
    def of(cls, study: Any) -> Self:
        """The section of a study; of one without it what an empty one says."""
        section = getattr(study, cls.command)
        return section if isinstance(section, cls) else cls()

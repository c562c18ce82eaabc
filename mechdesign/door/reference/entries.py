"""Entries of the reference."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Entry:
    """A word and its explanation; empty fields are not shown.

    Parameters
    ----------
    word : str
        A key by its path, with ``*`` for names and places in lists (``mechanism.joints.*.angle``); else as it is
        written.
    kind : str
        What it is: ``key``, ``command``, ``option``, ``unit``, ...
    takes : str
        What may stand there, written as in a study.
    mapping : str
        What each mapping is that may stand there, or in what does.
    default : str
        What is taken where it is left out, if that is one value; the text tells it otherwise.
    where : tuple of str
        Keys at which the word may stand, or commands that have it.
    words : tuple of (str, str)
        Words out of which one is chosen, and their meanings.
    """

    word: str
    kind: str
    text: str
    takes: str = ""
    mapping: str = ""
    unit: str = ""
    default: str = ""
    formula: str = ""
    source: str = ""
    where: tuple[str, ...] = ()
    examples: tuple[str, ...] = ()
    words: tuple[tuple[str, str], ...] = ()

    @property
    def plain(self) -> str:
        """The word as a user types it, without the ``*`` of names."""
        return self.word.replace(".*", "")

    @property
    def last(self) -> str:
        """The last part of a path, an option without its dashes, a table without its ending."""
        return self.plain.removesuffix(".csv").rpartition(".")[2].lstrip("-")

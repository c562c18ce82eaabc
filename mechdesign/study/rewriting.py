"""A study with other numbers, as text: comments kept where only numbers change, files that it names brought along."""

from __future__ import annotations

import hashlib
import json
import pathlib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import yaml

from mechdesign.errors import StudyError
from mechdesign.study.text.document import KeyPath, leaves, read

if TYPE_CHECKING:
    from mechdesign.study.loading import Study

# Bytes of a text beyond which it is written anew, without its comments.
_MOST_BYTES = 1_000_000
_INPUT = "input_"


def rewritten(study: Study, data: dict[str, Any], heading: str) -> tuple[str, dict[str, str]]:
    """A study's text where it says other values, and the files it needs beside it, by their names.

    Overrides are part of the new text, as is the seed. Comments are kept where no more than single values change.

    Parameters
    ----------
    data : dict
        The study as plain data, `Study.resolved` with other values; its names of files are brought up to date.
    heading : str
        What the first line says, as a comment.
    """
    files: dict[str, str] = {}
    for keys, file, content in inputs(study):
        beside = _INPUT + file.name
        while files.get(beside, content) != content:
            beside = "_" + beside
        files[beside] = content
        holder: Any = data
        for key in keys[:-1]:
            holder = holder[key]
        holder[keys[-1]] = beside
    text = _edited(study, data)
    if text is None:
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)
    return f"# {heading}\n{text}", files


def inputs(study: Study) -> Iterator[tuple[KeyPath, pathlib.Path, str]]:
    """Files that a study reads: the keys of their names, the file, and what it holds."""
    folder = study.path.parent if study.path is not None else pathlib.Path()
    for keys, value in leaves(study.resolved):
        if isinstance(value, str) and ("path" in keys[:-1] or "targets" in keys[:-1]):
            try:
                content = (folder / value).read_text(encoding="utf-8-sig")
            except (OSError, ValueError):
                continue
            yield keys, folder / value, content


def _edited(study: Study, data: Mapping[str, Any]) -> str | None:
    """The study's own text with single values changed; None where it would not say the same as `data`."""
    content = study.path.read_bytes() if study.path is not None and study.path.is_file() else b""
    if len(content) > _MOST_BYTES or hashlib.sha256(content).hexdigest() != study.text_sha256:
        return None
    if any(override.startswith("units") for override in study.overrides):
        return None
    text, document = content.decode("utf-8-sig"), read(content, "")
    written = document.data
    wanted = {key: value for key, value in data.items() if key in written}
    # Names of units in full are what the loader makes of the text.
    if "units" in written:
        wanted["units"] = written["units"]
    edits = []
    for keys, entries in _replaced(written, wanted, ()):
        name, value = document.keys[keys], document.values[keys]
        inside_flow = text[document.values[keys[:-1]].start] == "{"
        if "\n" in text[value.start : value.end].rstrip():
            return None
        between = ", " if inside_flow else "\n" + " " * (name.column - 1)
        edits.append((name.start, value.end, between.join(_in_one_line(*entry) for entry in entries.items())))
    now = dict(leaves(written))
    for keys, new in leaves(wanted):
        if keys in now and new != now[keys]:
            edits.append((document.values[keys].start, document.values[keys].end, json.dumps(new, ensure_ascii=False)))
    for start, end, replacement in sorted(edits, reverse=True):
        text = text[:start] + replacement + text[end:]
    if "seed" not in written and data["seed"]:
        wanted["seed"] = data["seed"]
        text = f"seed: {data['seed']}\n{text}"
    try:
        return text if read(text.encode(), "").data == wanted else None
    except StudyError:
        return None


def _replaced(old: Any, new: Any, keys: KeyPath) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Keys in whose place several others stand, and those with their values, where mappings differ in just that."""
    if not (isinstance(old, Mapping) and isinstance(new, Mapping)):
        return
    gone = [key for key in old if key not in new]
    if len(gone) == 1:
        yield (*keys, gone[0]), {key: value for key, value in new.items() if key not in old}
    for key in old:
        if key in new:
            yield from _replaced(old[key], new[key], (*keys, key))


def _in_one_line(key: str, value: Any) -> str:
    written = yaml.safe_dump({key: value}, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6)
    return written.strip()[1:-1]

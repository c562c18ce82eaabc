"""A study with other numbers, as text: comments kept where only numbers change, files that it names brought along."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from mechdesign.errors import StudyError
from mechdesign.study.text import document

if TYPE_CHECKING:
    from mechdesign.study.loading import Study

Keys = tuple[str | int, ...]
# Larger texts are not searched for the places of their numbers.
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


def inputs(study: Study) -> Iterator[tuple[Keys, Path, str]]:
    """Files that a study reads: the keys of their names, the file, and what it holds."""
    folder = study.path.parent if study.path is not None else Path()
    for keys, value in _leaves(study.resolved, ()):
        if isinstance(value, str) and ("path" in keys[:-1] or "targets" in keys[:-1]):
            try:
                content = (folder / value).read_text(encoding="utf-8-sig")
            except (OSError, ValueError):
                continue
            yield keys, folder / value, content


def _leaves(data: Any, keys: Keys) -> Iterator[tuple[Keys, Any]]:
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from _leaves(value, (*keys, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _leaves(value, (*keys, index))
    else:
        yield keys, data


def _edited(study: Study, data: Mapping[str, Any]) -> str | None:
    """The study's own text with single values changed; None where it would not say the same as `data`."""
    content = study.path.read_bytes() if study.path is not None and study.path.is_file() else b""
    if len(content) > _MOST_BYTES or hashlib.sha256(content).hexdigest() != study.text_sha256:
        return None
    text = content.decode("utf-8-sig")
    written = document.read(content, "").data
    wanted = {key: value for key, value in data.items() if key in written}
    if any(override.startswith("units") for override in study.overrides):
        return None
    # Names of units in full are what the loader makes of the text.
    if "units" in written:
        wanted["units"] = written["units"]
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        return None
    edits = []
    for keys, entries in _replaced(written, wanted, ()):
        edit = _entries(_node(root, keys[:-1]), str(keys[-1]), entries)
        if edit is None:
            return None
        edits.append(edit)
    now, new = dict(_leaves(written, ())), dict(_leaves(wanted, ()))
    for keys in [keys for keys in new if keys in now and new[keys] != now[keys]]:
        node = _node(root, keys)
        if not isinstance(node, yaml.ScalarNode):
            return None
        edits.append((node.start_mark.index, node.end_mark.index, json.dumps(new[keys], ensure_ascii=False)))
    for start, end, value in sorted(edits, reverse=True):
        text = text[:start] + value + text[end:]
    if "seed" not in written and data["seed"]:
        wanted["seed"] = data["seed"]
        text = f"seed: {data['seed']}\n{text}"
    try:
        return text if document.read(text.encode(), "").data == wanted else None
    except StudyError:
        return None


def _replaced(old: Any, new: Any, keys: Keys) -> Iterator[tuple[Keys, dict[str, Any]]]:
    """Keys in whose place several others stand, and those with their values, where mappings differ in just that."""
    if not (isinstance(old, Mapping) and isinstance(new, Mapping)):
        return
    gone = [key for key in old if key not in new]
    if len(gone) == 1:
        yield (*keys, gone[0]), {key: value for key, value in new.items() if key not in old}
    for key in old:
        if key in new:
            yield from _replaced(old[key], new[key], (*keys, key))


def _entries(node: yaml.Node | None, key: str, entries: Mapping[str, Any]) -> tuple[int, int, str] | None:
    """The edit that writes entries of a mapping in the place of one; None where that is more than a line."""
    if not isinstance(node, yaml.MappingNode):
        return None
    name, value = next(pair for pair in node.value if pair[0].value == key)
    if not (isinstance(value, yaml.ScalarNode) or value.flow_style):
        return None
    between = ", " if node.flow_style else "\n" + " " * name.start_mark.column
    written = [
        yaml.safe_dump({each: own}, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6).strip()[
            1:-1
        ]
        for each, own in entries.items()
    ]
    return name.start_mark.index, value.end_mark.index, between.join(written)


def _node(node: yaml.Node | None, keys: Keys) -> yaml.Node | None:
    """The node of a composed text at these keys."""
    for key in keys:
        if isinstance(node, yaml.MappingNode):
            node = next((value for name, value in node.value if name.value == key), None)
        elif isinstance(node, yaml.SequenceNode) and isinstance(key, int):
            node = node.value[key]
        else:
            return None
    return node

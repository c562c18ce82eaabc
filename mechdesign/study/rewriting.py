"""A study with other numbers, as text: comments kept where only numbers change, files that it names brought along."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from mechdesign.errors import StudyError
from mechdesign.study import document
from mechdesign.study.document import plain

if TYPE_CHECKING:
    from mechdesign.study.loading import Study

Keys = tuple[str | int, ...]
# Larger texts are not searched for the places of their numbers.
_MOST_BYTES = 1_000_000
_INPUT = "input_"


def rewritten(study: Study, numbers: Mapping[str, float], heading: str) -> tuple[str, dict[str, str]] | None:
    """The study's text with other numbers for parameters and dimensions, and the files it needs beside it.

    Overrides are part of the new text, as is the seed. Comments are kept where no more than single values change.

    Parameters
    ----------
    numbers : mapping of str to float
        By the names of parameters and places, in the study's units.
    heading : str
        What the first line says, as a comment.

    Returns
    -------
    (str, dict of str to str) or None
        None where the study has no place of its own for a number, as for a point that is measured from the sketch.
    """
    data = plain(study.resolved)
    try:
        for name, value in numbers.items():
            _set(data, _keys(study, data, name), float(value))
    except (KeyError, IndexError, TypeError, ValueError):
        return None
    files: dict[str, str] = {}
    for keys, file, content in inputs(study):
        beside = _INPUT + file.name
        while files.get(beside, content) != content:
            beside = "_" + beside
        files[beside] = content
        _set(data, keys, beside)
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


def _set(data: Any, keys: Keys, value: Any) -> None:
    last: Any = keys[-1]
    for key in keys[:-1]:
        data = data[key]
    if isinstance(data, list) and last == len(data):
        data.append(value)
    elif isinstance(data, list | dict):
        data[last] = value
    else:
        raise TypeError(keys)


def _keys(study: Study, data: Any, name: str) -> Keys:
    """Where the number of a parameter or a place stands, or would stand."""
    if name in study.parameters.nominal:
        return ("mechanism", "parameters", name)
    owner, _, rest = name.partition(".")
    section = data["mechanism"]
    if owner == "limits":
        index, _, key = rest.partition(".")
        return ("mechanism", "limits", int(index), key)
    if owner in section.get("joints", {}):
        return ("mechanism", "joints", owner, rest)
    link: Keys = ("mechanism", "links", owner)
    given = section["links"][owner]
    if rest == "length":
        return (*link, 2) if isinstance(given, list) else (*link, "length")
    point, _, axis = rest.rpartition(".")
    holder: Keys = (*link, "points") if "points" in given and point not in given else link
    return (*holder, point, "xy".index(axis))


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
    now, new = dict(_leaves(written, ())), dict(_leaves(wanted, ()))
    if now.keys() != new.keys():
        return None
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        return None
    edits = []
    for keys in [keys for keys in new if new[keys] != now[keys]]:
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

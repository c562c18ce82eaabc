"""Answers of batches in a file: blocks of rows of numbers, and beside them, as JSON, what is not a number."""

from __future__ import annotations

import io
import json
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from mechdesign.ground.numerics.arrays import Floats


def packed(head: Mapping[str, Any], blocks: Sequence[Floats]) -> bytes:
    """The content of the file."""
    stream = io.BytesIO()
    np.savez(
        stream,
        head=np.frombuffer(json.dumps(head).encode(), dtype=np.uint8),
        counts=np.array([len(block) for block in blocks], dtype=np.intp),
        rows=np.concatenate(blocks) if blocks else np.zeros((0, 0)),
    )
    return stream.getvalue()


def unpacked(path: Path) -> tuple[Mapping[str, Any], list[Floats]]:
    """What was packed.

    Raises
    ------
    ValueError
        If there is no such file, or it is damaged.
    """
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as content:
            head: Mapping[str, Any] = json.loads(content["head"].tobytes())
            return head, np.split(content["rows"], np.cumsum(content["counts"]))[:-1]
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile, zlib.error, RecursionError) as error:
        raise ValueError from error

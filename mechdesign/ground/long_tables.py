"""Tables of so many rows that they are made block by block, where they are written or judged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.columns import Column
from mechdesign.ground.results import Table


class LongTable(Table):
    """A table whose rows are made block by block.

    Whoever asks for the values of a column has all columns gathered, once, and then in memory.

    Parameters
    ----------
    some : Table
        Those of its rows that pictures show.
    count : int
        Number of all rows.
    source : callable
        Makes the rows, as tables one after the other; each call makes them anew.
    """

    def __init__(self, some: Table, count: int, source: Callable[[], Iterator[Table]]) -> None:
        columns = tuple(_LongColumn(column, self._values) for column in some.columns)
        self.__dict__.update(
            name=some.name, columns=columns, meaning=some.meaning, scope=some.scope, strands=some.strands,
            lacking=None, unassembled={},
            _some=some, _count=count, _source=source,
        )  # fmt: skip

    @property
    def seen(self) -> Table:
        """Those of its rows that pictures show."""
        some: Table = self.__dict__["_some"]
        return some

    def blocks(self) -> Iterator[Table]:
        """The rows, made anew, as tables one after the other."""
        blocks: Iterator[Table] = self.__dict__["_source"]()
        return blocks

    def take(self, rows: NDArray[Any]) -> Table:
        """The table of some rows, by a mask or by their numbers."""
        numbers = np.arange(len(self))[rows]
        parts, begin = [], 0
        for block in self.blocks():
            here = np.flatnonzero((numbers >= begin) & (numbers < begin + len(block)))
            parts.append((here, block.take(numbers[here] - begin)))
            begin += len(block)
            if begin > numbers.max(initial=-1):
                break
        order = np.argsort(np.concatenate([here for here, _ in parts]), kind="stable")
        return Table(self.name, tuple(
            replace(column, values=np.concatenate([part.columns[k].values for _, part in parts])[order])
            for k, column in enumerate(parts[0][1].columns)
        ), self.meaning)  # fmt: skip

    def __len__(self) -> int:
        return int(self.__dict__["_count"])

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Iterate over rows as dictionaries of Python scalars."""
        for block in self.blocks():
            yield from block

    def _values(self, name: str) -> NDArray[Any]:
        return self._gathered[name]

    @cached_property
    def _gathered(self) -> dict[str, NDArray[Any]]:
        parts: dict[str, list[NDArray[Any]]] = {name: [] for name in self.names}
        for block in self.blocks():
            for column in block.columns:
                parts[column.name].append(column.values)
        return {name: np.concatenate(parts.pop(name)) for name in self.names}


class _LongColumn(Column):
    """A column of a `LongTable`."""

    def __init__(self, like: Column, values: Callable[[str], NDArray[Any]]) -> None:
        attributes = {"name": like.name, "unit": like.unit, "meaning": like.meaning, "kind": like.kind}
        self.__dict__.update(attributes, _numeric=like.numeric, _values=values)

    @property
    def values(self) -> NDArray[Any]:
        values: NDArray[Any] = self.__dict__["_values"](self.name)
        return values

    @property
    def numeric(self) -> bool:
        return bool(self.__dict__["_numeric"])

"""Kinds of columns and tables: what stands at their places, units, several names."""

import pickle

import numpy as np
import pytest

from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.results import TableKind

SPEED = ColumnKind("<output>_velocity", "velocity of <output>", "as the output, per time")
SPRINGS = TableKind.of("springs", "springs <of what>", SPEED, ("x, y", "place of <link>", "length"), ("leg", "its leg"))


def test_names_of_the_study_stand_at_the_places():
    column = SPEED.column([1.0, 2.0], "mm/s", output="P.x")
    assert (column.name, column.unit, column.meaning) == ("P.x_velocity", "mm/s", "velocity of P.x")
    assert column.values.tolist() == [1.0, 2.0]


def test_angle_brackets_of_a_name_are_no_places():
    assert SPEED.column([1.0], output="min(a<b, c>d)").name == "min(a<b, c>d)_velocity"


def test_columns_of_a_table_have_the_units_of_their_kinds_in_the_order_asked():
    columns = SPRINGS.columns({"length": "mm", "link": "rod"}, leg=["a"], y=[2.0], x=[1.0])
    assert [(each.name, each.unit, each.meaning) for each in columns] == [
        ("leg", "", "its leg"), ("y", "mm", "place of rod"), ("x", "mm", "place of rod"),
    ]  # fmt: skip
    assert SPRINGS.table(columns, **{"of what": "of a table"}).meaning == "springs of a table"


def test_a_column_that_is_not_declared_is_refused():
    with pytest.raises(KeyError, match=r"declares no column .z.; it declares .*leg"):
        SPRINGS.columns({"length": "mm", "link": "rod"}, z=[1.0])


def test_a_column_keeps_its_kind_where_rows_are_taken_and_in_another_process():
    table = SPRINGS.table([SPEED.column(np.arange(3.0), output="P.x")], **{"of what": ""})
    assert table.take(np.array([0, 2])).columns[0].kind is SPEED
    assert pickle.loads(pickle.dumps(table)).columns[0].kind == SPEED

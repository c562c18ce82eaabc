"""CSV and JSON text of tables."""

import csv
import io
import json

import numpy as np

import mechdesign
from mechdesign.door.report.tables import from_csv, json_blocks, to_csv
from mechdesign.ground.long_tables import LongTable


def table(**columns):
    return mechdesign.Table("t", tuple(mechdesign.Column(name, np.asarray(values)) for name, values in columns.items()))


def test_numbers_have_twelve_significant_digits():
    text = to_csv(table(x=[1 / 3, 1e-17, 123456789.123456, np.nan, np.inf, -0.0]))
    assert text.split() == ["x", "0.333333333333", "1e-17", "123456789.123", "nan", "inf", "0"]


def test_booleans_are_one_and_zero_and_integers_stay_whole():
    assert to_csv(table(valid=[True, False], samples=[40000, 10**9])) == "valid,samples\n1,40000\n0,1000000000\n"


def test_awkward_text_survives_a_csv_reader():
    names = ['a "quoted", name', "ünïcödé", "plain"]
    assert [row[0] for row in csv.reader(io.StringIO(to_csv(table(name=names))))][1:] == names


def test_words_are_of_one_line_and_no_formula():
    words = ["two\nlines", "\x1b[2J\u202e", "=1+1", "+x", "-x", "@x", "-inf", "-3", "a=b"]
    text = to_csv(table(name=words))
    cells = [row[0] for row in csv.reader(io.StringIO(text))][1:]
    assert cells == [r"two\nlines", r"\x1b[2J\u202e", "'=1+1", "'+x", "'-x", "'@x", "-inf", "-3", "a=b"]
    assert from_csv(text, "t", [{"name": "name"}])["name"].tolist()[2:] == words[2:]


def test_json_has_null_for_what_is_not_a_number():
    rows = json.loads(
        "".join(json_blocks(table(x=[1.5, np.nan, np.inf], valid=[True, False, True], name=["a", "b", "é"])))
    )
    assert rows == [
        {"x": 1.5, "valid": 1, "name": "a"},
        {"x": None, "valid": 0, "name": "b"},
        {"x": None, "valid": 1, "name": "é"},
    ]


def test_json_and_csv_say_the_same_digits():
    value = 2 / 3
    assert json.loads("".join(json_blocks(table(x=[value]))))[0]["x"] == float(to_csv(table(x=[value])).split()[1])


def test_a_table_without_rows_is_an_empty_list():
    assert json.loads("".join(json_blocks(table(x=np.array([]))))) == []


def test_a_table_that_is_made_block_by_block_shows_itself_as_if_it_were_in_memory():
    whole = table(x=np.arange(30) / 7, valid=np.arange(30) > 0)
    long = LongTable(whole.take(np.arange(10)), 30, lambda: iter([whole]))
    assert long._repr_html_() == whole._repr_html_()

"""What is written in a way of its own: names, lines, tables, points and short forms of links."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator

from mechdesign.ground.errors import suggestion
from mechdesign.study.text import fields
from mechdesign.study.text.inputs import file_of
from mechdesign.study.text.reading import Context, failure, read_rows, shown

LINK_KEYS = ("from", "to", "length", "points", "telescopic", "mass", "center", "inertia", "rod", "width", "layer")
LINK_SHORT: tuple[fields.Form, ...] = (
    {
        "type": "array",
        "prefixItems": [fields.NAME_FORM, fields.NAME_FORM, fields.NUMBER_FORM],
        "minItems": 2,
        "maxItems": 3,
    },
    {
        "type": "object",
        "additionalProperties": {"anyOf": [fields.PAIR_FORM, {"type": "null"}]},
        "not": {"anyOf": [{"required": [key]} for key in LINK_KEYS]},
    },
)
Point = Annotated[tuple[fields.LengthPlace, fields.LengthPlace], fields.pair_of("[x, y]")]


def names_to_mapping(raw: Any) -> Any:
    """Bring ``[A, B]`` to ``{A: null, B: null}``; anything else passes."""
    if not isinstance(raw, list):
        return raw
    for name in raw:
        if not isinstance(name, str):
            raise failure(f"expected a name, not {shown(name)}")
        if raw.count(name) > 1:
            raise failure(f"{name!r} is listed twice")
    return dict.fromkeys(raw)


def long_link(raw: Any) -> Any:
    """The long form of a link."""
    if isinstance(raw, list):
        if len(raw) not in (2, 3):
            raise failure("expected [from, to, length], {from, to, length} or the link's points {A: [x, y], ...}")
        return dict(zip(("from", "to", "length"), raw, strict=False))
    if not isinstance(raw, dict):
        expected = "[from, to, length], {from, to, length} or its points {A: [x, y], ...}"
        raise failure(f"expected a link, {expected}, not {shown(raw)}")
    # A point may be named `center`, or `rod`.
    if any(key in raw and (key in LINK_KEYS[:6] or not isinstance(raw[key], list)) for key in LINK_KEYS):
        for key, value in raw.items():
            if key not in LINK_KEYS and isinstance(value, list):
                raise failure(f"beside 'from', 'to' and 'length' a point stands under 'points': {{{key}: [x, y]}}")
        return raw
    for key, value in raw.items():
        if not isinstance(value, list) and value is not None:
            hint = suggestion(key, LINK_KEYS)
            raise failure(f"{key!r} is neither a key of a link nor a point [x, y]{hint}")
    return {"points": raw}


def _through(raw: Any) -> Any:
    if isinstance(raw, str):
        return [raw]
    if not isinstance(raw, list) or len(raw) != 2:
        raise failure(f"expected a point or two points [P, R], not {shown(raw)}")
    return raw


_LINE = Annotated[
    tuple[fields.PointName, ...], BeforeValidator(_through), fields.OrShort({**fields.NAME_FORM, "title": "point"})
]


_TABLE_FORM: fields.Form = {"type": ["string", "object", "array"], "title": "table"}


def _table(raw: Any, context: Context) -> str | tuple[tuple[float, ...], ...]:
    file = file_of(raw)
    if file is not None:
        return file
    if not isinstance(raw, list):
        raise failure(f"expected a file of two columns, lift.csv, or rows [[0, 0], [30, 2.5], ...], not {shown(raw)}")
    return read_rows(raw, context, 2, "every row holds two numbers", "an empty table")


# What a mark of a notation reads, where it is not an annotation of `fields`.
BY_WORD: dict[str, Any] = {
    "text": str,
    "flag": bool,
    "points": Annotated[
        dict[fields.PointName, Point | None], BeforeValidator(names_to_mapping), fields.OrShort(fields.NAMES_FORM)
    ],
    "points of a line": _LINE,
    "range": Annotated[tuple[fields.Number, fields.Number], fields.pair_of("[first, last]")],
    "table": Annotated[Any, fields.Read(_table, _TABLE_FORM)],
    "diameters": dict[fields.PointName, fields.PositiveLengthPlace],
}

"""JSON Schema in words: the values of a key, for editors and the reference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from mechdesign.study.text import fields
from mechdesign.study.text.fields import Form

# Meanings of the words in titles that are not names of the study.
TERMS = {
    "number": "a number in the study's units, one with a unit of its own (40 mm, 600 rpm, 1e5 N*m/rad), or an "
    "expression over parameters",
    "expression": "numbers, names, functions and + - * / **, such as (l_min + R)/2; in quotes where it has a comma "
    "within { } or [ ]. Trigonometry takes and gives the study's unit of angle",
    "coordinate": "C.x and C.y of a point, rod.angle of a link (from the world's x axis), leg_1.length of a telescopic "
    "link, guide.slide of a slide; drives and measures by their names",
    "mapping": "keys and their values, {from: 0, to: 360} or one a line; its keys are told below",
}
_TYPES = {"string": "text", "number": "number", "integer": "whole number", "boolean": "true or false"}


class Generator(GenerateJsonSchema):
    """pydantic's generator without the titles that it makes of names."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Never: `name_forms` adds the titles."""
        return False

    def model_schema(self, schema: core_schema.ModelSchema) -> Form:
        """The schema of a model, without its title."""
        form = super().model_schema(schema)
        form.pop("title", None)
        return form

    def dict_schema(self, schema: core_schema.DictSchema) -> Form:
        """The schema of a mapping, whose keys and values keep their titles."""
        form = super().dict_schema(schema)
        if "keys_schema" in schema and schema["keys_schema"]["type"] != "str":
            form["propertyNames"] = self.generate_inner(schema["keys_schema"])
        if "values_schema" in schema:
            form["additionalProperties"] = self.generate_inner(schema["values_schema"])
        return form


def name_forms(schema: Form) -> None:
    """Give every property of a schema and its models a title: the values that it takes, in words."""
    for model in (schema, *schema["$defs"].values()):
        for form in properties(model).values():
            form["title"] = in_words(form, schema["$defs"])


def properties(model: Form) -> dict[str, Form]:
    """The schema of each key of a model; with short forms, the model is the first alternative."""
    properties: dict[str, Form] = model.get("anyOf", [model])[0]["properties"]
    return properties


def in_words(form: Form, models: Mapping[str, Form]) -> str:
    """The values that a form accepts, as written in a study; `models` are those that it refers to."""
    if "title" in form:
        return str(form["title"])
    if "$ref" in form:
        return in_words(models[form["$ref"].rpartition("/")[2]], models)
    if arms := form.get("anyOf", form.get("oneOf")):
        return " or ".join(dict.fromkeys(in_words(arm, models) for arm in arms if arm.get("type") != "null"))
    if "const" in form or "enum" in form:
        return " or ".join(map(str, form.get("enum", [form.get("const")])))
    if "prefixItems" in form:
        return f"[{', '.join(in_words(part, models) for part in form['prefixItems'])}]"
    if "items" in form:
        item = in_words(form["items"], models)
        return f"[{item}, {item}]" if form.get("maxItems") == 2 else f"[{item}, ...]"
    if isinstance(form.get("additionalProperties"), dict):
        by = in_words(form.get("propertyNames", fields.NAME_FORM), models)
        return f"{{{by}: {in_words(form['additionalProperties'], models)}, ...}}"
    return "mapping" if form.get("type") == "object" else _TYPES[form["type"]]

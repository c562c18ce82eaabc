"""Derivatives of results: of which, and with respect to what."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Self

from mechdesign.experiments.schema.matrix import Results
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.conditions import check_result
from mechdesign.study.text import fields
from mechdesign.study.text.reading import Context, failure, shown


def _name(raw: Any, _context: Context) -> str:
    if not isinstance(raw, str):
        raise failure(f"expected a parameter's name, such as r or stiffness.loads.P.0, not {shown(raw)}")
    return raw


class Changed(fields.Model):
    """A number of the study that changes, and by how much; its name alone says the same."""

    bare = "parameter"
    short: ClassVar[tuple[fields.Form, ...]] = ({**fields.NAME_FORM, "title": "parameter"},)
    parameter: Annotated[str, fields.Read(_name, {**fields.NAME_FORM, "title": "parameter"})]
    """A parameter of the mechanism, or any other entry that is a number by the name that ``--set`` takes. Example: r
    Example: mechanism.links.rod.length
    """
    step: fields.PositiveNumber | None = None
    """Largest change, in the study's units. Left out: 1 % of the value, which then must not be 0. Example: 0.5"""


class SensitivitiesSection(fields.Model):
    """Derivatives of results with respect to numbers of the study, by central differences."""

    results: Results
    """Results of any command, named as in ``matrix``. Example: [kinematics.mu.min, GII]"""
    parameters: Annotated[tuple[Changed, ...], fields.BeforeValidator(fields.as_list), fields.OrShort()]
    """Numbers of the study that change. Example: [r, {parameter: e, step: 0.5}]"""

    def faults(self) -> Iterator[str]:
        for key, example in (("results", "kinematics.mu.min"), ("parameters", "r")):
            if not getattr(self, key):
                yield f"{key!r} names nothing; name what there is, e.g. {key}: [{example}]"

    def checked(self, checker: Checker) -> Self:
        """Check the commands that results name; `experiments` checks that they have such a result."""
        for k, named in enumerate(self.results):
            check_result(checker, named.result, ("sensitivities", "results", k))
        return self

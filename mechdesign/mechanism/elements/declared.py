"""How an element declares its keys: by marks in the annotations of its fields.

A field with a mark is a key of the study's file. The docstring under it says what it means; its default is what counts
where a study leaves it out. A number of the geometry is a `Term`: the name of a *place*, or a plain number. Lengths are
in the study's unit, angles in radians.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

Term = str | float
Quantity = Literal["length", "angle", "none"]
# Kinds of numbers of masses and springs, as `mechdesign.study.text.units.KINDS` has them.
Physical = Literal[
    "mass", "moment_of_inertia", "force", "moment", "stiffness", "rotational_stiffness", "damping", "rotational_damping"
]  # fmt: skip
# Kinds between two links of what has these kinds between two points.
BETWEEN_LINKS: Mapping[str, Physical] = {
    "stiffness": "rotational_stiffness", "force": "moment", "damping": "rotational_damping",
}  # fmt: skip


@dataclass(frozen=True)
class Size:
    """Mark of a number of the geometry: its kind and its least value.

    What acts `between` two points or two links has another kind there, see `BETWEEN_LINKS`. One that is `fixed` is no
    place: it is the same for all designs that are answered together.
    """

    kind: Quantity | Physical | None
    least: float | None = None
    exclusive: bool = False
    between: bool = False
    fixed: bool = False

    def kind_of(self, *, turning: bool) -> Any:
        """Its kind between points, or between links."""
        return BETWEEN_LINKS.get(self.kind or "", self.kind) if turning else self.kind


class Choice(NamedTuple):
    """Mark of a word out of a list, each with its meaning."""

    words: Mapping[str, str]
    title: str


class Whole(NamedTuple):
    """Mark of a whole number with its bounds."""

    least: int
    most: int


class Notation(NamedTuple):
    """Mark of a name, or of what is written in a way of its own.

    The word is that of an annotation of `mechdesign.study.text.fields` or `mechdesign.study.building.notations`, or
    ``part`` of an element inside of another.
    """

    word: str


class Two(NamedTuple):
    """Mark of a list of two, described for a message."""

    text: str


@dataclass(frozen=True)
class Element:
    """Base of all elements."""

    #: A message, and keys of which exactly one is given.
    one_of: ClassVar[tuple[str, ...]] = ()

    #: The key of a value that may stand alone.
    bare: ClassVar[str] = ""

    name: str

    @property
    def kind(self) -> Any:
        """Which of the keys of `one_of` is given."""
        return next(key for key in self.one_of[1:] if getattr(self, key) is not None)

    @property
    def items(self: Any) -> tuple[str, ...]:
        """The names that this key has."""
        named = getattr(self, self.kind)
        return named if isinstance(named, tuple) else (named,)

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together; `given` has them as attributes, None where it has not."""
        return iter(())


LinkName = Annotated[str, Notation("LinkName")]
PointName = Annotated[str, Notation("PointName")]
EndName = Annotated[str, Notation("EndName")]
JointName = Annotated[str, Notation("JointName")]
DriveName = Annotated[str, Notation("DriveName")]
MeasureName = Annotated[str, Notation("MeasureName")]
CoordinateName = Annotated[str, Notation("CoordinateName")]
TwoLinks = Annotated[tuple[LinkName, LinkName], Two("a list of two names")]
TwoPoints = Annotated[tuple[PointName, PointName], Two("a list of two names")]
TwoEnds = Annotated[tuple[EndName, EndName], Two("a list of two names")]

Length = Annotated[Term, Size("length")]
PositiveLength = Annotated[Term, Size("length", 0.0, exclusive=True)]
NonNegativeLength = Annotated[Term, Size("length", 0.0)]
Angle = Annotated[Term, Size("angle")]
AnySize = Annotated[Term, Size(None)]

"""The methods of reliability, declared once: schema, checks, tables, pictures and `auto` follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Method:
    """A way to errors and probabilities of failure.

    Parameters
    ----------
    name : str
        Its word in studies and tables.
    words : str
        Its name in pictures.
    meaning : str
        What it computes, in a line.
    use : str
        When it is the right one and how accurate it is, in sentences.
    accuracy : int
        Rank, higher where its numbers are the more accurate ones; no two are alike. Where a picture has room for the
        numbers of one method, they are those of the highest rank.
    color, marker, dashes : str
        Color of `mechdesign.drawing.style` (vermilion is left to limits), Matplotlib's marker of its values, and
        dashes of computed values; those of made mechanisms have whiskers instead.
    sampled : bool
        Whether it solves made mechanisms at random. It takes ``samples``, and its probability has an interval.
    errors : bool
        Whether errors are drawn as they are made: moments, densities and whole cycles come from its samples.
    precise : bool
        Whether it ends where the ``precision`` of the study is reached.
    pin : "analytic" or "monte_carlo"
        The model of a pin in its hole that it takes: a key of `PinModel`.
    step : int
        Place among the steps of `auto`, which begins with plain samples; 0: none. Its module has a function ``rung``.
    module : str
        Module of its ``run(task)``, imported when it is needed; by default the one of its name.
    """

    name: str
    words: str
    meaning: str
    use: str
    accuracy: int = 0
    color: str = "YELLOW"
    marker: str = "h"
    dashes: Literal["-", "--", ":", "-."] = "-."
    sampled: bool = False
    errors: bool = False
    precise: bool = False
    pin: Literal["analytic", "monte_carlo"] = "monte_carlo"
    step: int = 0
    module: str = ""

    @property
    def place(self) -> str:
        """The module of its ``run(task)``."""
        return self.module or f"mechdesign.questions.reliability.methods.{self.name}"

    @property
    def detail(self) -> str:
        """What it computes, when to use it, how accurate it is, and the keys that it takes."""
        many = ", but where many limits are summed by sampling" if self.pin == "analytic" else ""
        interval = "a 99.7 % interval" if self.sampled else f"no interval{many}: it is as good as its model"
        keys = ["samples"] * self.sampled + ["precision"] * self.precise + [f"clearances.*.pin.{self.pin}"]
        return (
            f"{self.meaning[0].upper()}{self.meaning[1:]}. {self.use} Its probability of failure has {interval}. "
            f"Its keys: {', '.join(f'reliability.{key}' for key in keys)}."
        )


_METHODS = (
    Method(
        "analytic", "first order", "first-order errors, normal",
        "The first answer, and that of optimize for every design: it solves no made mechanism. It is right where the "
        "errors are linear over the tolerances, and of lengths about zero, which have their own law; it misses the "
        "shift of the mean at a dead centre.",
        1, "BLUE", "D", "-", pin="analytic",
    ),
    Method(
        "second_order", "second order", "second-order errors, normal about the shifted mean",
        "Where errors curve over the tolerances, as at the end of a stroke: mean and deviation are exact for quadratic "
        "errors, but the probability is still that of normal ones.",
        3, "SKY", "s", "--", pin="analytic",
    ),
    Method(
        "monte_carlo", "Monte Carlo", "made mechanisms, drawn at random",
        "The judge of the other methods: every made mechanism is solved exactly, and failures are counted. For "
        "one failure in a thousand ask for 100,000 samples.",
        4, "INK", "o", sampled=True, errors=True,
    ),
    Method(
        "form", "FORM", "tangents of the limits at their design points",
        "A check where failures are rare, from some hundred solved mechanisms. It is exact for limits that are flat in "
        "normal variables; of a curved one it is off by a factor that grows as failures become rarer.",
        2, "GREEN", "P", ":", step=1,
    ),
    Method(
        "importance_sampling", "importance sampling", "made mechanisms drawn about the design points",
        "Where failures are rare: it finds one in a billion from some ten thousand solved mechanisms, if the design "
        "points that it found are all that matter. It gives no moments.",
        5, "PURPLE", "X", sampled=True, step=2,
    ),
    Method(
        "auto", "auto", "the cheapest method that reaches the precision asked",
        "Where the probability of failure decides: it begins with plain samples and goes on to methods for rare "
        "failures where these are not precise enough. The column 'used' has the method that the value comes from; a "
        "warning tells where two disagree.",
        6, "ORANGE", "*", sampled=True, errors=True, precise=True,
    ),
)  # fmt: skip
METHODS = {method.name: method for method in _METHODS}

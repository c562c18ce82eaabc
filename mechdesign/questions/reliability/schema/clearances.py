"""Clearances of pins and slides, and backlash of couplings, as the study file gives them."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import model_validator

from mechdesign.mechanism.elements.couplings import play
from mechdesign.questions.reliability.fit_laws import FITS, fit_law
from mechdesign.questions.reliability.laws import LAWS, Marginal
from mechdesign.questions.reliability.schema.iso_tolerances import ToleranceClassError, fit_deviations
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.schema.variation import Dimension, Tolerance, millimetre
from mechdesign.study.schema.checker import Checker
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import Context, failure, shown
from mechdesign.study.text.units import kind_of

PIN_MODELS = {
    "normal": "x and y of the pin normal, the clearance three standard deviations; of a slider each end, of a coupling "
    "half its backlash",
    "normal_in_disc": "as normal, and cut at the circle of the clearance; of a slider at its walls, of a coupling at "
    "the flanks",
    "uniform": "anywhere in the circle of the clearance alike; of a slider each end between its walls, of a coupling "
    "between the flanks",
    "contact": "pin at the hole's wall, in any direction alike; of a slider each end at one wall or the other, of a "
    "coupling at one flank or the other",
}
# Methods by the pin model that they take.
BY_MOMENTS = ", ".join(method.name for method in METHODS.values() if method.pin == "analytic")
BY_PLACES = ", ".join(method.name for method in METHODS.values() if method.pin == "monte_carlo")
_EFFECTS = {
    "offset": "moves the joint's point in the link's frame, by x and y",
    "length": "changes the length r of a binary link alone, to sqrt((r + x)^2 + y^2)",
}
# The laws of a clearance: those without keys of their own.
_LAWS = {name: law for name, law in LAWS.items() if not law.keys}
LAWS_OF_FITS = " or ".join(FITS)
# Clearances down to minus this count as zero.
CLEARANCE_ROUNDING = 1e-9


class Fit(NamedTuple):
    """A fit as it is written, its mean diametral clearance, and half the tolerances of its hole and of its shaft."""

    text: str
    diametral: float
    hole: float
    shaft: float


def _fit(raw: Any, context: Context) -> Fit:
    if not isinstance(raw, str):
        raise failure(f"expected a fit such as 20 H7/g6, not {shown(raw)}")
    unit = millimetre(context, raw)
    try:
        _, hole, shaft = fit_deviations(raw)
    except ToleranceClassError as error:
        raise failure(str(error)) from None
    least, most = hole[0] - shaft[1], hole[1] - shaft[0]
    if least < -CLEARANCE_ROUNDING:
        kind = "an interference" if most <= CLEARANCE_ROUNDING else "a transition"
        raise failure(
            f"{raw} is {kind} fit, from {least:+.4g} to {most:+.4g} mm, and no clearance is negative; a pin that is "
            "pressed in has none: leave it out, or take a clearance fit such as H7/g6 or H7/h6"
        )
    halves = [float(0.5 * (high - low) * unit) for low, high in (hole, shaft)]
    return Fit(raw, float(0.5 * (least + most) * unit), *halves)


_FIT = {**fields.NAME_FORM, "title": "fit"}


class PinModel(fields.Model):
    """How a pin lies in its hole, for each kind of method; a word alone is for both."""

    short = ({"enum": list(PIN_MODELS), "title": "pin model"},)
    analytic: Annotated[str, fields.choice(PIN_MODELS, "pin model")] = "normal"
    """Model of the methods that compute with its moments: |BY_MOMENTS|."""
    monte_carlo: Annotated[str, fields.choice(PIN_MODELS, "pin model")] = "normal"
    """Model of the methods that place each pin: |BY_PLACES|."""

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return {"analytic": raw, "monte_carlo": raw} if isinstance(raw, str) else raw


class Clearance(fields.Model):
    """Clearance of a pin or slide, one of ``radial``, ``diametral`` and ``fit``, or the ``backlash`` of a coupling.
    Coordinates of a pin's point are those of the links in which it does not move; an output may name its link,
    coupler.P.x.
    """

    one_of = (
        "a clearance needs either 'radial' or 'diametral', a 'fit', or of a coupling its 'backlash'",
        "radial", "diametral", "fit", "backlash",
    )  # fmt: skip
    radial: fields.NonNegativeLength | None = None
    """Mean radial clearance: half the difference of the diameters; of a slide its play on either side. Example: 0.03"""
    diametral: fields.NonNegativeLength | None = None
    """Mean difference of the diameters of hole and pin. Example: 0.06"""
    fit: Annotated[Fit, fields.Read(_fit, _FIT)] | None = None
    """Fit of ISO 286-1 with its size in mm; tolerances of hole and shaft follow. Example: 20 H7/g6"""
    backlash: fields.NonNegative | None = None
    """Play of a coupling from one flank to the other: in the unit of the coordinate that follows, or of an angle as a
    length along the pitch circle of its wheel. It lies to both sides of the function. Example: 0.1 deg Example: 0.08 mm
    """
    tolerance: Tolerance = (0.0, 0.0)
    """How far the clearance given (radial, diametral or backlash) deviates: a half-width, or the lowest and highest. A
    fit has its own. Example: 0.01
    """
    distribution: Annotated[str, fields.choice(_LAWS, "distribution")] = "normal"
    """Distribution of the clearance over its tolerance; of a fit |LAWS_OF_FITS|."""
    pin: PinModel = PinModel()
    """How a pin lies in its hole, a slider in its guide, or a coupling between its flanks. Left out: normal, and of a
    coupling uniform. Example: normal_in_disc Example: {analytic: normal, monte_carlo: uniform}
    """
    link: fields.LinkName | None = None
    """Link in which the pin moves. Left out: the last link at the joint that no output is said to be of. Example:
    forearm
    """
    effect: Annotated[str, fields.choice(_EFFECTS, "effect of a clearance")] = "offset"
    """What the pin's place changes."""
    length: fields.PositiveLength | None = None
    """Length of a slider in its guide, centred on the joint's point: it shifts and tilts. Prismatic joints need it; no
    others have it. Example: 40
    """

    @property
    def radius(self) -> float:
        """Mean radial clearance, half the difference of the diameters or half the backlash."""
        return self.size if self.radial is not None else 0.5 * self.size

    @property
    def size(self) -> float:
        """What is given: the mean radial or diametral clearance, or the backlash."""
        given = (self.radial, self.diametral, self.backlash, self.fit.diametral if self.fit is not None else None)
        return next((size for size in given if size is not None), 0.0)

    @property
    def radius_spread(self) -> Dimension | None:
        """Variation of the radial clearance; None where it has none, and of a fit."""
        if not np.any(self.tolerance):
            return None
        factor = 1.0 if self.radial is not None else 0.5
        low, high = (factor * end for end in self.tolerance)
        return Dimension.model_construct(tolerance=(low, high), sigma=None, distribution=self.distribution)

    def law(self, factor: float = 1.0) -> Marginal | None:
        """Law of the radial clearance about its mean, where `factor` of the core's units are one of the study."""
        if self.fit is not None:
            return fit_law(self.distribution, self.fit.hole, self.fit.shaft, self.radius)
        spread = self.radius_spread
        return None if spread is None else spread.law(factor * self.radius, factor)

    def flaw(self) -> str:
        """The mistake in its numbers, of one design or several; empty if there is none."""
        spread = self.radius_spread
        if spread is None:
            return ""
        size, low = map(np.ravel, np.broadcast_arrays(self.radius, spread.ends(self.radius)[0]))
        least = int(np.argmin(size + low))
        if size[least] + low[least] < -CLEARANCE_ROUNDING:
            size, low = ((1.0 if self.radial is not None else 2.0) * part[least] for part in (size, low))
            jams = "such a pin does not go in its hole" if self.backlash is None else "such teeth jam"
            return f"a clearance of {size:g} that is {-low:g} smaller is negative: {jams}"
        return spread.flaw(self.radius)


def check_clearance(checker: Checker, point: str, clearance: Clearance, named: str | None) -> Clearance | None:
    """A clearance with the link that its pin moves in, not the one `named` by outputs; None without its joint."""
    path: KeyPath = ("reliability", "clearances", point)
    mechanism, report = checker.mechanism, checker.report
    if point in mechanism.couplings:
        return _check_backlash(checker, point, clearance, path)
    if clearance.backlash is not None and point in (*mechanism.owners, *mechanism.slides):
        message = "is the play of a coupling; of a pin or a slide give 'radial', 'diametral' or a 'fit'"
        report((*path, "backlash"), message, at_key=True)
    _check_radius(checker, clearance, path, "length")
    if point in mechanism.slides:
        return _check_slide_clearance(checker, clearance, path, tilts=mechanism.joints[point].prismatic is not None)
    names = [*mechanism.owners, *mechanism.slides, *mechanism.couplings]
    if not checker.check_name(point, names, "point, slide or coupling", path, at_key=True):
        return None
    if clearance.length is not None:
        report((*path, "length"), "is that of a slider in its guide; a pin's clearance has none")
    links = mechanism.owners[point]
    held = [*links, *(j.slot for j in mechanism.joints.values() if j.slot and j.point == point)]
    if len(held) < 2:
        report(path, f"only link {links[0]!r} has point {point!r}: no pin, no clearance", at_key=True)
    # By default the pin moves in the last link that no output or limit names.
    link = clearance.link or ([link for link in links if link != named] or links)[-1]
    if link not in links:
        checker.check_name(link, links, f"link at point {point!r} named", (*path, "link"))
    elif clearance.effect == "length":
        binary = mechanism.links[link]
        if point not in (binary.from_, binary.to) or binary.telescopic:
            message = f"changes a binary link's length, and {point!r} is no end of such a link in {link!r}"
            report((*path, "effect"), message)
    return clearance.model_copy(update={"link": link})


def _check_slide_clearance(checker: Checker, clearance: Clearance, path: KeyPath, *, tilts: bool) -> Clearance:
    for key in {"link", "effect"} & clearance.model_fields_set:
        checker.report((*path, key), f"a slide's clearance has no {key!r}: its slider shifts across the line")
    if tilts and clearance.length is None:
        message = "the slider tilts in its guide as far as its 'length' along the line lets it; give that too"
        checker.report(path, message, at_key=True)
    elif not tilts and clearance.length is not None:
        checker.report((*path, "length"), "a pin in a slot does not tilt; leave it out")
    return clearance


def _check_backlash(checker: Checker, coupling: str, clearance: Clearance, path: KeyPath) -> Clearance | None:
    """The backlash of a coupling, uniform where the study does not say; None where that of a pin is given."""
    for key in {"link", "effect", "length"} & clearance.model_fields_set:
        checker.report((*path, key), f"the backlash of a coupling has no {key!r}; leave it out", at_key=True)
    if clearance.backlash is None:
        message = f"{coupling!r} is a coupling: give its play from one flank to the other as 'backlash'"
        checker.report((*path, clearance.kind), message, at_key=True)
        return None
    place = checker.places.get(play(coupling))
    if place is None:  # the coupling itself has a mistake
        return None
    kind: str = place.quantity
    if kind == "angle" and kind_of(clearance.backlash) == "length":
        kind = "length"
        mechanism = checker.compiled
        if mechanism is not None and mechanism.pitch_radius(coupling, {}) is None:
            message = (
                f"is a length along a pitch circle, and that of {coupling!r} is not known: its axes are on no common "
                "link, or a belt has no 'radius'; give an angle"
            )
            checker.report((*path, "backlash"), message)
    checker.kind((*path, "backlash"), kind)
    _check_radius(checker, clearance, path, kind)
    left_out = {"analytic", "monte_carlo"} - clearance.pin.model_fields_set
    pin = clearance.pin.model_copy(update=dict.fromkeys(left_out, "uniform"))
    return clearance.model_copy(update={"pin": pin})


def _check_radius(checker: Checker, clearance: Clearance, path: KeyPath, kind: str) -> None:
    """Check the variation of the clearance, an angle or a length."""
    report = checker.report
    checker.kind((*path, "tolerance"), kind)
    if clearance.fit is not None:
        if "tolerance" in clearance.model_fields_set:
            report((*path, "tolerance"), "a fit has the tolerances of its hole and shaft; leave it out")
        if clearance.distribution not in FITS:
            report((*path, "distribution"), f"hole and shaft of a fit are {LAWS_OF_FITS} within their tolerances")
    if flaw := clearance.flaw():
        report((*path, "tolerance"), flaw)

"""Plates of a validated mechanism section."""

from __future__ import annotations

from mechdesign.mechanism.elements.plates import NO_CLASS, Plates
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.text.document import KeyPath


def build_plates(builder: Builder) -> Plates | None:
    """Plates without mistakes in their names, where the study gives a width; their numbers become places."""
    given, links = builder.section.plates, builder.section.links
    widths = {
        name: builder.place(("links", name, "width"), link.width)
        for name, link in links.items()
        if link.width is not None
    }
    layers = {name: link.layer for name, link in links.items() if link.layer is not None}
    lengths = builder.numbers(given, "plates") if given is not None else {}
    if "width" not in lengths and not widths:
        if given is not None:
            builder.report(("plates",), "plates need a 'width', of all or of a link", at_key=True)
        for name in layers:
            builder.report(("links", name), "a 'layer' belongs to plates; give mechanism.plates.width", at_key=True)
        return None
    lengths.setdefault("width", min(widths.values(), key=builder.nominal, default=0.0))
    pins = {
        name: builder.place(("plates", "pins", name), diameter)
        for name, diameter in (given.pins if given is not None else {}).items()
        if builder.reporter.check_name(
            name, builder.section.owners, "point", (*ROOT, "plates", "pins", name), at_key=True
        )
    }
    general = given.general_tolerance if given is not None else NO_CLASS
    plates = Plates("plates", **lengths, widths=widths, pins=pins, layers=layers, general_tolerance=general)
    _check_holes(builder, plates)
    return plates


def _check_holes(builder: Builder, plates: Plates) -> None:
    """Check that the holes of every given diameter are narrower than their links and wider than the kerf."""
    faults: dict[KeyPath, str] = {}
    for point, links in builder.section.owners.items():
        diameter = plates.pins.get(point, plates.pin)
        if len(links) < 2 or diameter is None:
            continue
        pin, kerf = builder.nominal(diameter), builder.nominal(plates.kerf)
        path: KeyPath = ("plates", "pins", point) if point in plates.pins else ("plates", "pin")
        widths = {link: builder.nominal(plates.widths.get(link, plates.width)) for link in links}
        link = min(widths, key=lambda name: widths[name])
        head = f"the pin at {point!r} has a diameter of {pin:g}"
        if pin >= widths[link]:
            message = f"{head}, and link {link!r} is {widths[link]:g} wide: its hole would cut the link through"
            faults.setdefault(path, message)
        if kerf >= pin:
            faults.setdefault(("plates", "kerf"), f"{head}, and the kerf is {kerf:g}: no hole would be left")
    for key, message in faults.items():
        builder.report(key, message, at_key=True)

"""Curves that random linkages draw, by closed form, are found again."""

from collections.abc import Iterator

import numpy as np
import pytest
import yaml
from helpers.syntheses import third

import mechdesign

# The crank's angles at which a curve is given.
AROUND = np.radians(np.arange(0, 360, 20))
# Links of a chain after the frame of 1: crank, coupler, rocker.
FAMILIES = ("four_bar", "slider_crank", "stephenson")


def curve(family: str, random: np.random.Generator) -> np.ndarray | None:
    """The coupler curve of a random linkage, turned, scaled and shifted; None unless its crank turns fully."""

    def length(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    def arm() -> complex:
        return complex(*random.uniform(-1, 1, 2))

    side = random.choice([-1.0, 1.0])
    crank, coupler = length(0.25, 0.6), length(0.8, 2)
    pin = crank * np.exp(1j * AROUND)
    if family == "slider_crank":
        rise = random.uniform(-0.4, 0.4)
        other = pin.real + side * np.sqrt((coupler**2 - (rise - pin.imag) ** 2).astype(complex)) + 1j * rise
        missed = np.abs(np.imag(other - 1j * rise)).max()
    else:
        other, missed = third(pin, 1.0 + 0j, coupler, length(0.8, 2), side)
    turn = (other - pin) / coupler
    if family == "stephenson":
        start = pin + turn * coupler * (0.5 + arm())
        far, stay = 1.5 * arm() + 0.5, length(0.8, 2)
        reach = length(0.8, 2)
        end, more = third(start, far, reach, stay, random.choice([-1.0, 1.0]))
        point = start + (end - start) * (0.5 + arm())
        missed = np.max(missed) + np.max(more)
    else:
        point = pin + turn * coupler * (0.5 + arm())
    if np.max(missed) > 0:
        return None
    return np.asarray((length(0.2, 5) * np.exp(2j * np.pi * random.uniform())) * point + 10 * arm())


def errors(family: str, count: int) -> Iterator[float]:
    """Root mean square distances from so many curves, as parts of their sizes."""
    random = np.random.default_rng(7)
    while count:
        points = curve(family, random)
        if points is None:
            continue
        count -= 1
        path = {"points": [[z.real, z.imag] for z in points.tolist()], "closed": True}
        task = {"path": path, "kinds": family, "limits": {"reach": 5, "ratio": 12}}
        study = mechdesign.load(text=yaml.safe_dump({"synthesis": task}))
        yield (
            mechdesign.synthesize(study, seed=1).tables["solutions"]["error"].min()
            / np.ptp([points.real, points.imag], axis=1).max()
        )


@pytest.mark.parametrize(
    ("family", "count"),
    [
        pytest.param("four_bar", 1, marks=pytest.mark.slow),
        *(pytest.param(name, 40, marks=pytest.mark.nightly) for name in FAMILIES),
    ],
)
def test_a_linkage_is_found_that_draws_the_curve_of_a_random_one(family: str, count: int) -> None:
    found = np.sort([*errors(family, count)])
    assert np.median(found) < 1e-4
    assert np.quantile(found, 0.95) < 1e-2


@pytest.mark.nightly
def test_both_crank_rockers_of_a_curve_are_listed() -> None:
    # Roberts 1875: the third pivot completes, with the two others, a triangle like that of the coupler.
    pin, coupler, arm = 0.4 * np.exp(1j * AROUND), 1.1, 0.6 + 0.5j
    other, _ = third(pin, 1 + 0j, coupler, 0.9, 1.0)
    points = pin + (other - pin) / coupler * arm
    path = {"points": [[z.real, z.imag] for z in points.tolist()], "closed": True}
    study = mechdesign.load(text=yaml.safe_dump({"synthesis": {"path": path, "limits": {"reach": 5, "ratio": 12}}}))
    table = mechdesign.synthesize(study, seed=1).tables["solutions"]
    exact = np.asarray(table["max_error"]) < 1e-9
    cranks = table["ground.O.x"][exact] + 1j * table["ground.O.y"][exact]
    assert len(cranks) == 2
    assert np.abs(np.sort_complex(cranks) - [0, arm / coupler]).max() < 1e-9

"""Reliability against plain simulation and exact probabilities that share nothing with the package.

Closed kinematics of an arm, a slider-crank and a four-bar, written out here, with every law of a pin in its hole; and
errors that are linear in normal dimensions and in the places of pins, whose probability of failure follows from the
characteristic functions of the laws: exp(-s^2/18) of a normal pin of sigma 1/3, J0(s) of one in contact and
2 J1(s)/s of a uniform one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import j0, j1
from scipy.stats import beta

import mechdesign
from mechdesign.ground.numerics.arrays import Floats

Seeds = Callable[[int], Iterator[int]]

MODELS = ("normal", "normal_in_disc", "uniform", "contact")
# Chance of more misses of 99.7 % intervals than a test allows.
TAIL = 1e-3


def pins(rng: np.random.Generator, model: str, count: int) -> Floats:
    """Places of pins in holes of radius 1, shape (2, count)."""
    if model == "contact":
        angle = rng.uniform(0, 2 * np.pi, count)
        return np.stack([np.cos(angle), np.sin(angle)])
    if model == "uniform":
        angle, radius = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0, 1, count))
        return radius * np.stack([np.cos(angle), np.sin(angle)])
    place = rng.standard_normal((2, count)) / 3
    while model == "normal_in_disc" and (outside := (place**2).sum(axis=0) > 1).any():
        place[:, outside] = rng.standard_normal((2, int(outside.sum()))) / 3
    return place


@dataclass(frozen=True)
class Plain:
    """A study, and the errors of its limited point by kinematics of its own."""

    text: str
    errors: Callable[[np.random.Generator, int], Floats]
    limit: str


def turned(angle: Floats | float, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y


def arm(rng: np.random.Generator, model: str) -> Plain:
    """The point of an arm whose pin moves in it at the ground."""
    length, q, clearance = rng.uniform(50, 150), np.radians(rng.uniform(-170, 170)), rng.uniform(0.01, 0.05)
    text = f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: [O, P, {length:.9g}]}}
  drives: {{q: {{angle: arm}}}}
  sketch: {{P: [{length * np.cos(q):.9g}, {length * np.sin(q):.9g}]}}
reliability:
  poses: [{{q: {np.degrees(q):.9g}}}]
  dimensions: {{arm.length: {{sigma: 0.02}}, q: {{sigma: 0.005}}}}
  clearances: {{O: {{radial: {clearance:.9g}, link: arm, pin: {model}}}}}
"""

    def errors(rng: np.random.Generator, count: int) -> Floats:
        made, angle = length + 0.02 * rng.standard_normal(count), q + np.radians(0.005) * rng.standard_normal(count)
        along, across = clearance * pins(rng, model, count)
        x, y = turned(angle, made - along, -across)
        return np.stack([x - length * np.cos(q), y - length * np.sin(q)])

    return Plain(text, errors, "P")


def slider_crank(rng: np.random.Generator, model: str) -> Plain:
    """The slider's pin along its guide, the rod's pin moving in the rod."""
    crank, rod, theta = rng.uniform(60, 110), rng.uniform(220, 320), np.radians(rng.uniform(0, 360))
    clearance = rng.uniform(0.02, 0.2)
    a = crank * np.exp(1j * theta)
    text = f"""
mechanism:
  links: {{ground: {{O: [0, 0]}}, crank: [O, A, {crank:.9g}], rod: [A, B, {rod:.9g}], slider: {{B: [0, 0]}}}}
  joints: {{guide: {{prismatic: [ground, slider], through: O}}}}
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [{a.real:.9g}, {a.imag:.9g}], B: [{a.real + rod:.9g}, 0]}}
reliability:
  poses: [{{theta: {np.degrees(theta):.9g}}}]
  dimensions: {{crank.length: {{sigma: 0.03}}, rod.length: {{sigma: 0.04}}}}
  clearances: {{A: {{radial: {clearance:.9g}, link: rod, pin: {model}}}}}
"""

    def errors(rng: np.random.Generator, count: int) -> Floats:
        a = (crank + 0.03 * rng.standard_normal(count)) * np.exp(1j * theta)
        made, (along, across) = rod + 0.04 * rng.standard_normal(count), clearance * pins(rng, model, count)
        reach = np.hypot(made - along, across)
        x = a.real + np.sqrt(reach**2 - a.imag**2)
        nominal = crank * np.cos(theta) + np.sqrt(rod**2 - (crank * np.sin(theta)) ** 2)
        return np.stack([x - nominal, np.zeros(count)])

    return Plain(text, errors, "B")


def four_bar(rng: np.random.Generator, model: str) -> Plain:
    """The rocker's pin; the crank's pin moves in the coupler."""
    crank, coupler, rocker, base = 100.0, rng.uniform(300, 350), rng.uniform(250, 300), rng.uniform(320, 380)
    theta, clearance = np.radians(rng.uniform(0, 360)), rng.uniform(0.02, 0.2)

    def rocker_pin(b: Floats, reach: Floats, rocker: Floats) -> Floats:
        """Upper meeting of the circles about b and the rocker's pivot."""
        gap = np.abs(base - b)
        along = (gap**2 + reach**2 - rocker**2) / (2 * gap)
        return b + (base - b) / gap * (along + 1j * np.sqrt(reach**2 - along**2))

    b = crank * np.exp(1j * theta)
    c = complex(rocker_pin(np.array(b), np.array(coupler), np.array(rocker)))
    text = f"""
mechanism:
  links:
    ground: {{A: [0, 0], D: [{base:.9g}, 0]}}
    crank: [A, B, {crank:.9g}]
    coupler: [B, C, {coupler:.9g}]
    rocker: [D, C, {rocker:.9g}]
  drives: {{theta: {{angle: crank}}}}
  sketch: {{B: [{b.real:.9g}, {b.imag:.9g}], C: [{c.real:.9g}, {c.imag:.9g}]}}
reliability:
  poses: [{{theta: {np.degrees(theta):.9g}}}]
  dimensions: {{crank.length: {{sigma: 0.03}}, coupler.length: {{sigma: 0.02}}, rocker.length: {{sigma: 0.03}}}}
  clearances: {{B: {{radial: {clearance:.9g}, link: coupler, pin: {model}}}}}
"""

    def errors(rng: np.random.Generator, count: int) -> Floats:
        b = (crank + 0.03 * rng.standard_normal(count)) * np.exp(1j * theta)
        along, across = clearance * pins(rng, model, count)
        reach = np.hypot(coupler + 0.02 * rng.standard_normal(count) - along, across)
        found = rocker_pin(b, reach, rocker + 0.03 * rng.standard_normal(count)) - c
        return np.stack([found.real, found.imag])

    return Plain(text, errors, "C")


@pytest.mark.parametrize("kind", [arm, slider_crank, four_bar])
def test_samples_against_plain_simulation(kind: Callable[..., Plain], seeds: Seeds) -> None:
    """Intervals of every method that claims one overlap that of a simulation that is written here."""
    for seed in seeds(2):
        rng = np.random.default_rng(seed)
        plain = kind(rng, MODELS[seed % 4])
        errors = plain.errors(rng, 200_000)
        share = 10 ** rng.uniform(-3, -1.5)
        radius = float(np.quantile(np.hypot(*errors), 1 - share))
        failures = int(np.count_nonzero(np.hypot(*errors) > radius))
        low, high = beta.ppf([0.0005, 0.9995], [failures, failures + 1], [200_001 - failures, 200_000 - failures])
        limits = f"reliability.limits={{{plain.limit}: {{radius: {radius:.9g}}}}}"
        methods = "reliability.methods=[monte_carlo, importance_sampling, auto]"
        study = study_of(plain.text, limits, methods, "reliability.samples=20000")
        table = mechdesign.reliability(study, seed=seed).tables["reliability"]
        for method, least, most in zip(table["method"], table["failure_low"], table["failure_high"], strict=True):
            assert least <= high, (seed, method, least, high)
            assert low <= most, (seed, method, low, most)


def characteristic(model: str, s: Floats) -> Floats:
    """Of one coordinate of a pin in a hole of radius 1, in any direction."""
    if model == "normal":
        return np.exp(-s * s / 18)
    if model == "contact":
        return np.asarray(j0(s))
    if model == "uniform":
        return np.where(s > 1e-8, 2 * j1(s) / np.maximum(s, 1e-8), 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(80)
    radius = 0.5 * (nodes + 1)
    density = 4.5 * weights * radius * np.exp(-4.5 * radius**2) / (1 - np.exp(-4.5))
    return np.asarray(j0(s[..., None] * radius) @ density)


def arms_text(count: int, model: str, clearances: Floats, sigma: float) -> str:
    """A chain that the ground carries rigidly but for its pins: a stack of arms at right angles, all drives exact."""
    names = [chr(ord("A") + k) for k in range(count + 1)]
    links = [f"arm{k}: [{names[k]}, {names[k + 1]}, 100]" for k in range(count)]
    angles = [90.0 * (k % 2) for k in range(count)]
    places = np.cumsum([100 * np.array([np.cos(np.radians(a)), np.sin(np.radians(a))]) for a in angles], axis=0)
    held = [f"{names[k]}: {{radial: {clearances[k]:.9g}, link: arm{k}, pin: {model}}}" for k in range(count)]
    return f"""
mechanism:
  links: {{ground: {{A: [0, 0]}}, {", ".join(links)}}}
  drives: {{{", ".join(f"q{k}: {{angle: arm{k}}}" for k in range(count))}}}
  sketch: {{{", ".join(f"{n}: [{x:.6f}, {y:.6f}]" for n, (x, y) in zip(names[1:], places, strict=True))}}}
reliability:
  poses: [{{{", ".join(f"q{k}: {a}" for k, a in enumerate(angles))}}}]
  dimensions: {{ground.A.x: {{sigma: {sigma:.9g}}}, ground.A.y: {{sigma: {sigma:.9g}}}}}
  clearances: {{{", ".join(held)}}}
  samples: 20000
  precision: 0.05
"""


def outside(model: str, clearances: Floats, sigma: float, size: float, shape: str) -> float:
    """P(sum of a normal vector and pins outside a circle, or a square, of this half-width), by Fourier integrals."""
    reach = 9 * sigma + clearances.sum() + size
    step, most = np.pi / reach, np.sqrt(2 * 50.0) / sigma
    if shape == "circle":
        # P(inside) = R integral of phi(k) J1(R k) dk, by panels that are short beside the waves of both.
        nodes, parts = np.polynomial.legendre.leggauss(12)
        edges = step * np.arange(int(most / step) + 2)
        k = (edges[:-1, None] + 0.5 * step * (nodes + 1)).ravel()
        weights = np.tile(0.5 * step * parts, len(edges) - 1)
    else:
        line = step * np.arange(-int(most / step) - 1, int(most / step) + 2)
        k = np.hypot(line[:, None], line)
    phi = np.exp(-0.5 * (sigma * k) ** 2)
    for clearance in clearances:
        phi = phi * characteristic(model, clearance * k)
    if shape == "circle":
        return float(1 - size * (weights * phi * j1(size * k)).sum())
    side = 2 * size * np.sinc(line * size / np.pi) * step / (2 * np.pi)
    return float(1 - side @ phi @ side)


def misses_allowed(count: int) -> int:
    """So many of `count` 99.7 % intervals miss with a chance below one in a thousand."""
    chance, allowed, term = 0.997**count, 0, 0.997**count
    while 1 - chance > TAIL:
        allowed += 1
        term *= (count - allowed + 1) / allowed * 0.003 / 0.997
        chance += term
    return allowed


def covered(model: str, number: int, seed: int, runs: int) -> None:
    """One exactly known chain, asked again and again."""
    rng = np.random.default_rng([seed, number])
    sigma, clearances = 0.02, 0.02 * 10 ** rng.uniform(-0.5, 0.7, number)
    shape, wanted = ("circle", "square")[seed % 2], 10 ** rng.uniform(-6, -2)
    low, high = 0.01, 1.5 * clearances.sum() + 0.2
    for _ in range(50):
        size = 0.5 * (low + high)
        low, high = (size, high) if outside(model, clearances, sigma, size, shape) > wanted else (low, size)
    exact = outside(model, clearances, sigma, size, shape)
    point = chr(ord("A") + number)
    limits = (
        f"{{{point}: {{radius: {size:.9g}}}}}"
        if shape == "circle"
        else f"{{{point}.x: {size:.9g}, {point}.y: {size:.9g}}}"
    )
    study = study_of(
        arms_text(number, model, clearances, sigma), f"reliability.limits={limits}",
        "reliability.methods=[form, importance_sampling, auto]", "reliability.sobol=0",
    )  # fmt: skip
    missed = dict.fromkeys(("importance_sampling", "auto"), 0)
    for run in range(runs):
        table = mechdesign.reliability(study, seed=run).tables["reliability"]
        low_, high_ = table["failure_low"], table["failure_high"]
        for method, least, most in zip(table["method"].tolist(), low_, high_, strict=True):
            if method in missed:
                missed[method] += not least <= exact <= most
            else:
                # Of a circle the tangents are one or two where the whole rim counts.
                assert 0.2 < float(least) / exact < (600 if model == "uniform" else 10), (seed, model, number)
        # An interval that holds everything covers nothing; what `form` says is none.
        sampled = np.isin(table["method"], list(missed))
        assert (high_[sampled] < 2 * exact).all() or model == "uniform"
    assert max(missed.values()) <= misses_allowed(runs), (seed, model, number, missed, exact)


@pytest.mark.parametrize("model", MODELS)
def test_intervals_cover_exact_probabilities(model: str, seeds: Seeds) -> None:
    for seed in seeds(1):
        covered(model, 1 + 2 * seed % 6, seed, 6)


def test_a_pin_in_contact_fails_on_both_sides() -> None:
    """An arm whose circle is left on two sides: one of them used to be reported with a tight interval."""
    exact = 7.58e-4
    text = """
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, P, 100]}
  drives: {q: {angle: arm}}
  sketch: {P: [80, 60]}
reliability:
  poses: [{q: 30}]
  dimensions: {arm.length: {sigma: 0.02}, q: {sigma: 0.005}}
  clearances: {O: {radial: 0.02, link: arm, pin: contact}}
  limits: {P: {radius: 0.08}}
  methods: [form, importance_sampling, auto]
  samples: 10000
  sobol: 0
"""
    study = study_of(text)
    for seed in range(6):
        form, sampled, auto = mechdesign.reliability(study, seed=seed).tables["reliability"]["failure"]
        # The tangents of a rim that curves; they used to say 0.996 where 0.026 was right.
        assert form == pytest.approx(exact, rel=0.15)
        assert sampled == pytest.approx(exact, rel=0.2)
        assert auto == pytest.approx(exact, rel=0.2)


def test_a_uniform_pin_near_its_rim_has_a_design_point() -> None:
    """The search swung about it and gave up, where one in a hundred fails."""
    clearances, sigma, size = np.array([1.18]), 0.37, 1.63
    exact = outside("uniform", clearances, sigma, size, "square")
    study = study_of(
        arms_text(1, "uniform", clearances, sigma), f"reliability.limits={{B.x: {size}, B.y: {size}}}",
        "reliability.methods=[importance_sampling]",
    )  # fmt: skip
    table = mechdesign.reliability(study).tables["reliability"]
    assert table["failure"][0] == pytest.approx(exact, rel=0.1)

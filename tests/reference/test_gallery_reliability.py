"""Studies of the gallery that ask for reliability, against formulas and simulations written without the package."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.closed_forms import slider_crank_slopes
from helpers.gallery import meet, study_named, unit

import mechdesign
from mechdesign.ground.results import Table


def below(x):
    """Standard normal distribution."""
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


def rows(table: Table, **chosen: object):
    """Rows in which columns have these values."""
    found = np.ones(len(table), dtype=bool)
    for name, value in chosen.items():
        found &= table[name] == value
    return found


def test_function_generator_as_made() -> None:
    # Made mechanisms by circles: the coupler's and the follower's, with each pin where it lies in its hole.
    study = study_named("function_generator_made", "reliability.samples=20000")
    result = mechdesign.reliability(study)
    rng = np.random.default_rng(11)
    count = 20_000
    a, b, c, d, zero = (
        nominal + spread
        for nominal, spread in zip(
            (71.3, 165.8, 71.57, 100.0, 0.0),
            (*rng.normal(0, 0.01, (4, count)), rng.uniform(-0.02, 0.02, count)),
            strict=True,
        )
    )
    crank = np.arange(90.0, 150.1, 2.5)
    moments, table = result.tables["moments"], result.tables["reliability"]

    def pin():
        # Uniform in the disc of the radial clearance.
        return 0.01 * np.sqrt(rng.uniform(size=count)) * np.exp(2j * np.pi * rng.uniform(size=count))

    failed = np.zeros(count, dtype=bool)
    for degrees in crank:
        # The pin at A moves in the crank's frame, the pin at B in the coupler's: both are parts of their links' lengths
        # and directions, and rotations of uniform discs are the same discs.
        at_a, at_b = pin(), pin()

        def follower(turn, a, b, c, d, at_a, at_b):
            elbow = (a + at_a) * unit(turn)
            reach = np.abs(b + at_b)
            return np.degrees(np.angle(meet(elbow, reach, d, c, 1) - d))

        def rate(turn, *made):
            return 10 * (follower(turn + 0.01, *made) - follower(turn - 0.01, *made)) / 0.02

        nominal = (71.3, 165.8, 71.57, 100.0, 0.0, 0.0)
        made = (a, b, c, d, at_a, at_b)
        position = follower(degrees + zero, *made) - follower(degrees, *nominal)
        velocity = rate(degrees + zero, *made) - rate(degrees, *nominal)
        for order, errors in (("position", position), ("velocity", velocity)):
            for method, tolerance in (("analytic", 0.02), ("monte_carlo", 0.03)):
                sigma = moments["sigma"][rows(moments, crank=degrees, method=method, order=order)][0]
                assert sigma == pytest.approx(errors.std(), rel=tolerance)
        broken = (np.abs(position) > 0.07) | (velocity > 0.018)
        own = rows(table, crank=degrees, method="monte_carlo")
        share = broken.mean()
        spread = math.sqrt(max(share, 1e-4) * 2 / count)
        assert table["failure"][own][0] == pytest.approx(share, abs=4 * spread)
        failed |= broken
    whole = rows(table, scope="cycle", method="monte_carlo")
    assert table["failure"][whole][0] == pytest.approx(failed.mean(), abs=4 * math.sqrt(failed.mean() * 2 / count))
    bounds = rows(table, scope="cycle", method="analytic")
    poses = rows(table, scope="pose", method="analytic")
    assert table["failure_low"][bounds][0] == pytest.approx(table["failure"][poses].max())
    assert table["failure_high"][bounds][0] == pytest.approx(table["failure"][poses].sum())


def test_two_arms_bored_in_one_setting() -> None:
    # The rod's tilt is ((dr2 - dr1)/sin + (drod - dframe)/tan)/span. A normal tolerance is three sigma about its
    # middle, a triangular law from low to high that peaks at 0 has the variance (low^2 + high^2 - low high)/18.
    result = mechdesign.reliability(study_named("bored_in_one_setting"))
    moments, table = result.tables["moments"], result.tables["reliability"]
    arm, wide = 0.01, math.sqrt((0.01**2 + 0.02**2 + 0.01 * 0.02) / 18)
    for degrees in (60.0, 90.0, 120.0):
        sin, tan = math.sin(math.radians(degrees)), math.tan(math.radians(degrees))
        tilt = math.degrees(math.sqrt(2 * (1 - 0.9) * (arm / sin) ** 2 + 2 * (wide / tan) ** 2) / 200)
        own = rows(moments, arm_1=degrees, output="rod.angle")
        for method, tolerance in (("analytic", 1e-6), ("monte_carlo", 0.02)):
            assert moments["sigma"][own & (moments["method"] == method)][0] == pytest.approx(tilt, rel=tolerance)
        broken = 2 * below(-0.006 / tilt)
        if degrees == 90.0:
            # Upright arms lift the rod by their mean error: 0.03 in the middle of its law.
            error = moments["mean"] - moments["nominal"]
            raised = rows(moments, arm_1=degrees, output="T.y", method="analytic")
            assert error[raised] == pytest.approx([0.03])
            broken += below(-(0.07 - 0.03) / (arm * math.sqrt((1 + 0.9) / 2)))
        assert table["failure"][rows(table, arm_1=degrees, method="analytic")][0] == pytest.approx(broken, rel=0.02)
        sampled = rows(table, arm_1=degrees, method="auto")
        # The linear model is good to a few per cent; so is the triangular law taken as a normal one.
        assert table["failure"][sampled][0] == pytest.approx(broken, rel=0.25)
    alone = mechdesign.reliability(study_named("bored_in_one_setting", "reliability.correlation=[]"))
    table = alone.tables["reliability"]
    own = rows(table, arm_1=90.0, method="monte_carlo")
    expected = 2 * below(-0.006 / math.degrees(math.sqrt(2) * arm / 200))
    assert expected == pytest.approx(1 / 7, abs=0.005)
    assert table["failure_low"][own][0] < expected < table["failure_high"][own][0]


@pytest.mark.nightly
def test_precision_of_a_five_bar_over_its_workspace() -> None:
    # u_i . dC = u_i . dD_i + dl_i; a circle of a bivariate normal error by quadrature over the direction:
    # P(|dC| > R) is the mean over directions u of exp(-R^2/(2 u' S u)) weighted with the density of the direction.
    result = mechdesign.reliability(study_named("five_bar_precision_map"))
    moments, table = result.tables["moments"], result.tables["reliability"]
    sigma_x, sigma_y = (moments["sigma"][rows(moments, output=f"C.{axis}")] for axis in "xy")
    c = table["C.x"] + 1j * table["C.y"]
    assert len(c) > 1500
    # On the boundary a leg is stretched and the unit vectors are no more than its limit.
    inside = (np.abs(c - 100) < 330) & (np.abs(c + 100) < 330)
    c = c[inside]
    jacobian, sources = [], []
    for base, side in ((100.0, 1), (-100.0, -1)):
        elbow = meet(base, 120.0, c, 220.0, -side)
        along = (c - elbow) / 220.0
        lower = (elbow - base) / 120.0
        jacobian.append(along)
        # The lower link's length and angle, and the upper link's length.
        dot = (along.conj() * lower).real
        cross = (along.conj() * 1j * lower).real * 120.0
        sources.append((0.01 * dot) ** 2 + (math.radians(0.01) / 3 * cross) ** 2 + 0.01**2)
    # C's pin in the second upper link: a normal radius/3 cut to its disc, of which along u2 counts.
    cut = 1 - 4.5 * math.exp(-4.5) / (1 - math.exp(-4.5))
    sources[1] = sources[1] + (0.01 / 3) ** 2 * cut
    (u1, u2), (v1, v2) = jacobian, sources
    det = (u1.conj() * u2).imag
    # dC = (w1 i u2* ...): the inverse of the rows u1, u2.
    col1, col2 = -1j * u2 / det, 1j * u1 / det
    xx = col1.real**2 * v1 + col2.real**2 * v2
    yy = col1.imag**2 * v1 + col2.imag**2 * v2
    xy = col1.real * col1.imag * v1 + col2.real * col2.imag * v2
    assert sigma_x[inside] == pytest.approx(np.sqrt(xx), rel=2e-3)
    assert sigma_y[inside] == pytest.approx(np.sqrt(yy), rel=2e-3)
    turn = np.linspace(0, math.pi, 721)[:-1, None]
    inverse = (yy * np.cos(turn) ** 2 - 2 * xy * np.cos(turn) * np.sin(turn) + xx * np.sin(turn) ** 2) / (
        xx * yy - xy**2
    )
    outside = np.mean(np.exp(-0.5 * 0.1**2 * inverse) / inverse, axis=0) / np.sqrt(xx * yy - xy**2)
    often = outside > 1e-9
    assert np.count_nonzero(often) > 200
    assert table["failure"][inside][often] == pytest.approx(outside[often], rel=0.05)


def test_feeder_with_the_cheapest_tolerances() -> None:
    result = mechdesign.reliability(study_named("cheapest_tolerances"))
    table = result.tables["allocation"]
    given, found, prices = table["given"][:3], table["allocated"][:3], np.array([1.0, 2.0, 5.0])
    stops = (-60.0, -20.0, 20.0)
    slopes = np.array([slider_crank_slopes(80, 200, 60, degrees) for degrees in stops])
    # The bearing's pin shifts the rod's end along the rod.
    pin = np.array([s[1] for s in slopes]) * 0.02 / 3 * math.sqrt(1 - 4.5 * math.exp(-4.5) / (1 - math.exp(-4.5)))

    def failure(tolerances):
        sigma = np.sqrt(((slopes * tolerances / 3) ** 2).sum(axis=1) + pin**2)
        return np.array([2 * below(-0.15 / s) for s in sigma])

    assert failure(given).max() == pytest.approx(1 / 7, rel=0.1)
    assert failure(found).max() == pytest.approx(1e-3, rel=2e-3)
    # Karush, Kuhn and Tucker: the gradient of the cost is a sum, with positive weights, of those of the variances at
    # the stops that decide.
    decides = failure(found) > 0.99e-3
    growth = slopes[decides] ** 2 * found
    weights = np.linalg.lstsq(growth.T, prices / found**2, rcond=None)[0]
    assert (weights > 0).all()
    assert growth.T @ weights == pytest.approx(prices / found**2, rel=2e-3)
    # All tightened alike are dearer.
    low, high = 0.0, 1.0
    for _ in range(60):
        alike = 0.5 * (low + high)
        low, high = (alike, high) if failure(alike * given).max() < 1e-3 else (low, alike)
    assert (prices / found).sum() < 0.9 * (prices / (low * given)).sum()
    again = result.tables["confirmation"]
    assert (again["low"] < 1).all()
    assert (again["high"] > 0.999).all()


def test_arm_under_an_unknown_parcel() -> None:
    # Deflections J K^-1 J' F of the soft gears, and the slopes of an arm's tip by its lengths and angles.
    result = mechdesign.reliability(study_named("loaded_arm"))
    moments, table = result.tables["moments"], result.tables["reliability"]
    for place in (600 + 100j, 450 + 300j):
        elbow = meet(0j, 400.0, place, 300.0, 1)
        slopes = np.array([1j * place, 1j * (place - elbow)])
        jacobian = np.stack([slopes.real, slopes.imag])
        soft = jacobian @ np.diag([1 / 4e7, 1 / 2e7]) @ jacobian.T
        parts = [
            *(np.array([u.real, u.imag]) * 0.1 / 3 for u in (elbow / 400, (place - elbow) / 300)),
            *(jacobian.T * math.radians(0.01) / 3),
            soft[:, 1] * 12,
        ]
        own = rows(moments, **{"P.x": place.real, "method": "analytic"})
        assert (moments["mean"] - moments["nominal"])[own] == pytest.approx(soft[:, 1] * -60, rel=1e-6)
        covariance = sum(np.outer(part, part) for part in parts)
        assert moments["sigma"][own] == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-6)
        drawn = np.random.default_rng(5).multivariate_normal(soft[:, 1] * -60, covariance, 400_000)
        share = float((np.hypot(*drawn.T) > 1.2).mean())
        for method in ("analytic", "monte_carlo", "auto"):
            failure = table["failure"][rows(table, **{"P.x": place.real, "method": method})][0]
            assert failure == pytest.approx(share, rel=0.1, abs=1e-5)

"""Closed forms of the cases of the verification manual that take more than a line, written without the package."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize
from scipy.special import ellipk, j0, ndtr, ndtri

from helpers.circles import common_area
from helpers.gallery import meet


def moment(about, at, other, sign=1):
    """Moment about a place of a force of 1 at `at` along the line from `other`; towards it with the sign -1."""
    span = sign * (at - other)
    return np.imag(np.conj(at - about) * span / np.abs(span))


def five_bar_jacobian(place: complex):
    """J = Jx^-1 Jq of the loops |C - D_i| = const, elbows out [Gosselin and Angeles, 1990]."""
    rows, cranks = [], []
    for base, side in ((-0.15, 1), (0.15, -1)):
        reach = abs(place - base)
        lift = np.arccos((reach**2 + 0.25**2 - 0.4**2) / (2 * 0.25 * reach))
        elbow = base + 0.25 * np.exp(1j * (np.angle(place - base) + side * lift))
        rod = place - elbow
        rows.append([rod.real, rod.imag])
        cranks.append(np.imag(np.conj(elbow - base) * rod))
    return np.linalg.solve(rows, np.diag(cranks))


def force(tables, joint: str, on: str):
    """Force of a joint on a link, or on this by another, over the poses of a table of joint forces."""
    table = tables["joint_forces"]
    own = (table["joint"] == joint) & ((table["on"] == on) | (table["by"] == on))
    sign = np.where(table["on"] == on, 1, -1)
    return ((table["fx"] + 1j * table["fy"]) * sign)[own]


def gained(table):
    """What the energies of a motion in time have gained beyond its work, as a part of the largest kinetic energy."""
    energy = table["kinetic_energy"] + table["potential_energy"] - table["work"]
    return np.abs(energy - energy[0]).max() / table["kinetic_energy"].max()


def pendulum(inertia: float, moment: float, times):
    """Angle of a pendulum (J, m r; SI) that starts upright at -1 rad/s, by SciPy's Runge-Kutta method of order 8."""

    def slope(_, state):
        return [state[1], -9.81 * moment / inertia * math.cos(state[0])]

    return solve_ivp(slope, (0, times[-1]), [math.pi / 2, -1], "DOP853", times, rtol=1e-13, atol=1e-13).y[0]


def v_twin(t):
    """Shaking force (N a kg of a piston with its share of the rod) of a balanced V-twin over the crank's angle."""
    r, length, omega = 40.0, 140.0, 100 * np.pi
    first = r * omega**2 * np.exp(1j * t)
    total = -first
    for bore in (np.pi / 4, 3 * np.pi / 4):
        sine, cosine = np.sin(t - bore), np.cos(t - bore)
        root = np.sqrt(length**2 - (r * sine) ** 2)
        second = -r * omega**2 * (cosine + r * (cosine**2 - sine**2) / root + r**3 * (sine * cosine) ** 2 / root**3)
        total = total - second * np.exp(1j * bore)
    return 1e-3 * total


def elliptic(parameter: float) -> float:
    """Complete elliptic integral of the first kind."""
    return float(ellipk(parameter))


def double_pendulum(first: float, second: float, times):
    """Angles of two bars of 1 m and 1 kg that hang from one another, the second's in the imaginary part (SI)."""

    def slope(_, state):
        one, two, u, v = state
        cross = 0.5 * math.cos(one - two)
        mass = [[4 / 3, cross], [cross, 1 / 3]]
        turned = 0.5 * math.sin(one - two)
        load = [-turned * v**2 - 9.81 * 1.5 * math.cos(one), turned * u**2 - 9.81 * 0.5 * math.cos(two)]
        return [u, v, *np.linalg.solve(mass, load)]

    angles = solve_ivp(slope, (0, times[-1]), [first, second, 0, 0], "DOP853", times, rtol=1e-12, atol=1e-12).y
    return angles[0] + 1j * angles[1]


def coasting_crank(angle: float, speed: float, times):
    """Crank angle of the slider-crank of 1 and 2 m with its masses (SI): J(t) omega^2 keeps its value."""

    def inertia(t):
        """Twice the kinetic energy at a speed of 1."""
        swing = -math.cos(t) / math.sqrt(4 - math.sin(t) ** 2)
        slider = -math.sin(t) + 2 * math.sin(t) / 2 * swing
        middle = 1j * np.exp(1j * t) + 1j * swing * np.exp(-1j * math.asin(math.sin(t) / 2))
        return 1 / 3 + abs(middle) ** 2 + 0.3 * swing**2 + slider**2

    energy = inertia(angle) * speed**2

    def slope(_, state):
        return [math.sqrt(energy / inertia(state[0]))]

    return solve_ivp(slope, (0, times[-1]), [angle], "DOP853", times, rtol=1e-12, atol=1e-12).y[0]


def excavator_boom(length):
    """Force of the boom cylinder of the lifting excavator of the gallery (kN), cylinders of stick and bucket held."""
    foot, at_boom, seat = 0.5 - 0.3j, 2.3 + 0.65j, 2.5 + 0.85j
    # The boom from the triangle of its pivot, the cylinder's foot and its head.
    inner = np.arccos((abs(foot) ** 2 + abs(at_boom) ** 2 - length**2) / (2 * abs(foot) * abs(at_boom)))
    boom = np.exp(1j * (np.angle(foot) + inner - np.angle(at_boom)))
    j, s, head = 5.2 * boom, seat * boom, at_boom * boom
    # The stick by its end E, the bucket by the four-bar of rocker and coupler.
    e = meet(j, abs(-0.75 + 0.1j), s, 2.3, -1)
    stick = (e - j) / (-0.75 + 0.1j)
    k, h, low = (j + stick * place for place in (2.6, 0.1 + 0.55j, 2.2 + 0.05j))
    m = meet(h, 2.2, low, 0.55, 1)
    n = meet(m, 0.5, k, abs(0.1 + 0.4j), 1)
    bucket = (n - k) / (0.1 + 0.4j)
    places = ((1450, boom * (2.4 + 0.45j)), (720, j + stick * (0.8 + 0.15j)), (2300, k + bucket * (0.65 + 0.2j)))
    turning = sum(9.81e-3 * mass * np.real(place) for mass, place in places)
    return turning / (np.imag(np.conj(foot) * (head - foot)) / np.abs(head - foot))


def friction_circle():
    """Pulls at the bell crank whose joint force touches the circle of 2 mm, up and down."""
    a, b, circle, weight = 60.0, 40.0, 0.25 * 8, 100.0
    # (Q b - W a)^2 = circle^2 (Q^2 + W^2)
    return np.roots([b**2 - circle**2, -2 * a * b * weight, weight**2 * (a**2 - circle**2)])


def softest(place):
    """Smallest stiffness of the stiffness map's platform at 30 deg, free to turn."""
    base = np.array([-300, 300, 520j])
    pins = np.array([-100 - 58j, 100 - 58j, 115j]) * np.exp(1j * np.radians(30))
    along = place[:, None] + pins - base
    along /= np.abs(along)
    rows = np.stack([along.real, along.imag, (np.conj(pins) * along).imag], axis=2)
    soft = np.linalg.inv(2e4 * np.einsum("nki,nkj->nij", rows, rows))
    return 1 / np.linalg.eigvalsh(soft[:, :2, :2])[:, -1]


def knuckle_press(degrees):
    """Stiffness of the ram of the gallery's knuckle press, by the energy of a push of 1."""
    return np.array([_knuckle_press(theta) for theta in degrees])


def _knuckle_press(theta: float) -> float:
    crank, rod, lower, upper, base = 50.0, 140.0, 270.0, 440.0, 136 + 270j
    a = base + crank * np.exp(1j * np.radians(theta))
    # B by the law of cosines, right of the line from O4 to A's other side: nearer to the y axis than A.
    span = abs(a)
    along = (lower**2 - rod**2 + span**2) / (2 * span)
    b = a / span * (along + 1j * np.sqrt(lower**2 - along**2))
    s = 1j * (b.imag + np.sqrt(upper**2 - b.real**2))
    # The ram is pushed down by 1: the upper link's push, in line with itself; then the knuckle's balance.
    u_upper, u_lower, u_rod = (s - b) / upper, b / lower, (a - b) / rod
    push_upper = 1 / u_upper.imag
    matrix = np.array([[u_lower.real, -u_rod.real], [u_lower.imag, -u_rod.imag]])
    # At the knuckle: upper pushes along -u_upper, lower along +u_lower, rod along -u_rod.
    push_lower, push_rod = np.linalg.solve(matrix, [push_upper * u_upper.real, push_upper * u_upper.imag])
    guide = push_upper * u_upper.real
    on_crank = push_rod * u_rod
    arm = (a - base) / crank
    axial, across = (on_crank * arm.conjugate()).real, (on_crank * arm.conjugate()).imag
    E, G = 210e3, 81e3
    bar, inertia = 40 * 80, 40 * 80**3 / 12
    tube = np.pi / 4 * (60**2 - 30**2)
    energy = (
        push_upper**2 * upper / (E * bar) + push_lower**2 * lower / (E * bar) + push_rod**2 * rod / (E * tube)
        + axial**2 * crank / (E * bar)
        + across**2 * (crank**3 / (3 * E * inertia) + crank / (5 / 6 * G * bar))
        + (across * crank) ** 2 / 1e7
        + (push_upper**2 + push_lower**2 + push_rod**2) / 2e6
        + guide**2 / 1e6
    )  # fmt: skip
    return 1 / energy


def slider_crank_slopes(crank: float, rod: float, guide: float, degrees: float):
    """ds/dr, ds/dl, ds/de of s = r cos(theta) + sqrt(l^2 - (r sin(theta) - e)^2): crank, rod, guide."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    across = crank * sin - guide
    along = math.sqrt(rod * rod - across * across)
    return np.array([cos - sin * across / along, rod / along, across / along])


def slider_crank_linear(degrees):
    """Failure probability of the gallery's slider-crank with tolerances, of the first order."""
    slopes = np.array([slider_crank_slopes(100, 200, -20, at) for at in degrees])
    return 2 * ndtr(-0.5 / np.sqrt(((slopes * [0.1, 0.2, 0.1]) ** 2).sum(axis=1)))


def slider_crank_failure(degrees):
    """The same exactly: over crank and guide by Gauss and Hermite, over the rod in closed form."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    weights = weights / weights.sum()
    total = []
    for at in np.radians(degrees):
        nominal = 100 * np.cos(at) + np.sqrt(200**2 - (100 * np.sin(at) + 20) ** 2)
        crank, guide = 100 + 0.1 * nodes[:, None], -20 + 0.1 * nodes
        within = 0.0
        for side in (1, -1):
            # The rod of a slider that is half a millimetre off.
            rod = np.hypot(nominal + side * 0.5 - crank * np.cos(at), crank * np.sin(at) - guide)
            within = within + side * ndtr((rod - 200) / 0.2)
        total.append(1 - weights @ within @ weights)
    return np.array(total)


def loaded_arm(x):
    """Mean shift along x and y, standard deviation along x and y, of the gallery's loaded arm at its two places."""
    every = []
    for place in np.where(np.isclose(x, 600), 600 + 100j, 450 + 300j):
        elbow = meet(0j, 400.0, place, 300.0, 1)
        slopes = np.array([1j * place, 1j * (place - elbow)])
        jacobian = np.stack([slopes.real, slopes.imag])
        soft = jacobian @ np.diag([1 / 4e7, 1 / 2e7]) @ jacobian.T
        parts = [*(np.array([u.real, u.imag]) * 0.1 / 3 for u in (elbow / 400, (place - elbow) / 300)),
                 *(jacobian.T * math.radians(0.01) / 3), soft[:, 1] * 12]  # fmt: skip
        every.append([*(soft[:, 1] * -60), *np.sqrt(sum(part**2 for part in parts))])
    return np.transpose(every)


def five_bar_sigma(place):
    """Standard deviations along x and y of the gallery's five-bar with its map of precision."""
    jacobian, sources = [], []
    for base, side in ((100.0, 1), (-100.0, -1)):
        elbow = meet(base, 120.0, place, 220.0, -side)
        along, lower = (place - elbow) / 220.0, (elbow - base) / 120.0
        jacobian.append(along)
        # The lower link's length and angle, and the upper link's length.
        dot, cross = (along.conj() * lower).real, (along.conj() * 1j * lower).real * 120.0
        sources.append((0.01 * dot) ** 2 + (math.radians(0.01) / 3 * cross) ** 2 + 0.01**2)
    # The tip's pin in the second upper link: a normal radius/3 cut to its disc, of which along the link counts.
    sources[1] = sources[1] + (0.01 / 3) ** 2 * (1 - 4.5 * math.exp(-4.5) / (1 - math.exp(-4.5)))
    (u1, u2), (v1, v2) = jacobian, sources
    det = (u1.conj() * u2).imag
    one, two = -1j * u2 / det, 1j * u1 / det
    return np.sqrt([one.real**2 * v1 + two.real**2 * v2, one.imag**2 * v1 + two.imag**2 * v2])


def arm_failure(limit: float) -> float:
    """Failure probability of S2's arm at 30 and 60 deg, its pins normal and cut to their holes.

    The tip errs by the sum of both lengths' errors and both pins' places. The characteristic function of the sum is
    the product of theirs; its Fourier series over a square of 0.4 cm, far wider than any error, gives the probability.
    """
    node, weight = np.polynomial.legendre.leggauss(16)
    radius = (node + 1) / 2
    share = weight * radius * np.exp(-4.5 * radius**2)
    normal, density = np.polynomial.hermite_e.hermegauss(10)
    k = np.arange(-200, 201) * 2 * np.pi / 0.4
    x, y = k[:, None], k
    at = np.linspace(0, 1.001 * np.hypot(k[-1], k[-1]), 2001)
    pin = sum(part * (j0(np.outer(clearance * at, radius)) @ share)
              for clearance, part in zip(0.03 + 0.01 / 3 * normal, density, strict=True))  # fmt: skip
    pins = make_interp_spline(at, pin / pin[0], k=7)(np.hypot(x, y)) ** 2
    lengths = sum((x * np.cos(angle) + y * np.sin(angle)) ** 2 for angle in np.radians([30, 60]))
    square = 2 * limit / 0.4 * np.sinc(k * limit / np.pi)
    return 1 - (np.exp(-lengths * 0.01**2 / 2) * pins * square[:, None] * square).sum()


def cheapest_tolerances():
    """Crank, rod and guide of the gallery's feeder: least cost with one failure in a thousand at its worst stop."""
    slopes = np.array([slider_crank_slopes(80, 200, 60, degrees) for degrees in (-60.0, -20.0, 20.0)])
    # The bearing's pin shifts the rod's end along the rod.
    pin = slopes[:, 1] * 0.02 / 3 * math.sqrt(1 - 4.5 * math.exp(-4.5) / (1 - math.exp(-4.5)))
    level = 0.15 / -ndtri(0.5e-3)

    def room(tolerances):
        return level**2 - ((slopes * tolerances / 3) ** 2).sum(axis=1) - pin**2

    def cost(tolerances):
        return float(np.sum([1.0, 2.0, 5.0] / tolerances))

    starts = np.random.default_rng(1).uniform(0.02, 0.1, (20, 3))
    safe = {"type": "ineq", "fun": lambda tolerances: room(tolerances) / level**2}
    ends = [minimize(cost, start, method="SLSQP", bounds=[(1e-3, 1)] * 3, constraints=safe) for start in starts]
    return min((end for end in ends if end.success), key=lambda end: end.fun).x


def arm_condition(l1: float, l2: float, q2):
    """Inverse condition of two links, from trace and determinant of J^T J in the frame of the first."""
    trace, determinant = 2 * l1 * l2 * np.cos(q2) + l1**2 + 2 * l2**2, l1 * l2 * np.abs(np.sin(q2))
    half = trace / (2 * np.maximum(determinant, 1e-300))
    return half - np.sqrt(np.maximum(half**2 - 1, 0))


def arm_mean(l1: float, l2: float) -> float:
    """Its mean over the annulus."""
    return quad(lambda q2: arm_condition(l1, l2, q2) * np.sin(q2), 0, np.pi, epsabs=1e-12)[0] / 2


def platform_areas(low: float, high: float, degrees):
    """Areas that a platform of three corners reaches at angles, with legs between two lengths."""
    bases, corners = np.array([0, 1, 0.5 + 0.9j]), np.array([-0.15 - 0.1j, 0.15 - 0.1j, 0.2j])
    return [common_area([(complex(centre), low, high) for centre in bases - turn * corners])
            for turn in np.exp(1j * np.radians(degrees))]  # fmt: skip


def gallery_platform_areas(degrees):
    """The same of the gallery's 3-RRR platform."""
    corners = np.exp(1j * np.radians([210, -30, 90]))
    return [common_area([(complex(250 * corner - 60 * turn * corner), 40.0, 280.0) for corner in corners])
            for turn in np.exp(1j * np.radians(degrees))]  # fmt: skip


def counted_area(centres, low: float, high: float) -> float:
    """Area of the common part of annuli, by points on a grid of 1 mm."""
    x, y = np.meshgrid(np.arange(-0.8, 0.8, 1e-3) + 5e-4, np.arange(-0.7, 0.7, 1e-3) + 5e-4)
    inside = np.ones(x.shape, dtype=bool)
    for centre in centres:
        distance = np.hypot(x - centre, y)
        inside &= (distance >= low) & (distance <= high)
    return float(inside.sum() * 1e-6)


def best_conditions(first, second: float):
    """Largest inverse condition over the elbow's angle, of arms."""
    q2 = np.linspace(0.01, np.pi - 0.01, 20001)
    return np.array([arm_condition(l1, second, q2).max() for l1 in first])


def hoeken_errors(first, third):
    """Largest deviation from the line over half a turn of Hoeken's linkages with a crank of 1, each 0.01 deg."""
    pin, errors = np.exp(1j * np.radians(np.linspace(90, 270, 18001))), []
    for l1, l3 in zip(first, third, strict=True):
        path = pin + 2 * (meet(pin, l3, l1, l3, 1) - pin)
        errors.append(np.abs(path.imag - np.sqrt(4 * l3**2 - (l1 + 1) ** 2)).max())
    return np.array(errors)


def s1_means(least: float, upper: float = 0.0):
    """GII, GRI and SUI of S1's 2-RPR, or of its 2-RRR with lower links of 1 (= R), by quadrature in polar coordinates.

    The substitution takes the roots of the resistivity at the boundary away; differences of squares are factored.
    """
    x, w = np.polynomial.legendre.leggauss(300)
    t, rest, w = np.sin(np.pi / 4 * (x + 1)) ** 2, np.sin(np.pi / 4 * (1 - x)) ** 2, w * np.sin(np.pi / 2 * (x + 1))
    most, angle = least + 2, np.pi / 2 * t[:, None]
    cosine = np.cos(angle)
    inner, outer = cosine + np.sqrt(least**2 - np.sin(angle) ** 2), np.sqrt(most**2 - np.sin(angle) ** 2) - cosine
    width, rows = np.maximum(outer - inner, 1e-30), []
    r = inner + width * t
    weights = w[:, None] * w * width * r
    near, far = width * t * (r + inner - 2 * cosine), width * rest * (outer + r + 2 * cosine)
    for base, side in ((1, -1), (-1, 1)):
        leg = r * np.exp(1j * angle) - base
        d = np.abs(leg)
        if not upper:
            rows.append(leg / d)
            continue
        elbow = leg / d * np.exp(1j * side * np.arccos(np.clip((1 + d**2 - upper**2) / (2 * d), -1, 1)))
        more = 4 * r * cosine
        rows.append((leg - elbow) / np.sqrt((near + more * (base < 0)) * (far + more * (base > 0))) * 2)
    determinant = np.abs(np.imag(np.conj(rows[0]) * rows[1]))
    k = (np.abs(rows[0]) ** 2 + np.abs(rows[1]) ** 2) / determinant
    inverse_condition = 2 / (k + np.sqrt(np.maximum(k**2 - 4, 0)))
    gii, gri = ((weights * index).sum() / weights.sum() for index in (inverse_condition, determinant))
    return gii, gri, weights.sum() * (np.pi**3 / 32) / ((most - 1) * np.sqrt(most**2 - 1))

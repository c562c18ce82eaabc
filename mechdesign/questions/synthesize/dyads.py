"""Dyads that guide a body through given positions, all of them, by one elimination.

A dyad joins the body to the frame. At position j, with the place P and the rotation R (complex, of size 1), it fulfils
one equation that is linear in eight homogeneous real unknowns, w, k, and the parts of X, A and q:

    w |P|^2 + k + 2 Re(conj(P) R X) - 2 Re(conj(A) P) - 2 Re(q R) = 0,     and once for all  w q = conj(A) X

- w = 1: a link, from the pivot A of the frame to the pin X of the body, its length^2 = |X|^2 + |A|^2 - k;
- w = 0, X = 0: a slide of the frame, along which the pin q / conj(A) of the body moves; A is normal to it;
- w = 0, A = 0: a slide of the body with the normal X, on which the pivot conj(q / X) of the frame lies.

So many rows as leave three unknowns free make of the last equation two conics, which meet in four points at most. Five
positions are five rows; each wish (a pivot on a line, a slide) is one more, and a given pivot or pin is four.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.numerics.arrays import Complexes, Floats

LINK, SLIDE, GUIDE = "link", "slide", "guide"
# Positions, and wishes in their place, that leave a link no choice.
EXACTLY = 5
# A vector, or the weight w, is zero below this part of the greatest unknown.
NOTHING = 1e-9
# Rows are dependent where a singular value is below this part of the greatest.
_DEPENDENT = 1e-11
# Unknowns count where w q - conj(A) X is below this.
_FULFILLED = 1e-8
# The plane of the conics is turned so that their points lie at infinity by accident only.
_TURN = np.linalg.qr(np.array([[0.83, -0.41, 0.36], [0.29, 0.77, -0.57], [-0.47, 0.58, 0.68]]))[0]
# Roots with a smaller part of an imaginary one may be two that nearly meet.
_NEARLY_REAL = 1e-3
_NEWTON_STEPS = 12
# Unknowns nearer than this are the same.
_SAME = 1e-7


@dataclass(frozen=True)
class Dyads:
    """Dyads of one kind, each field of shape (count,)."""

    kind: str  # LINK; SLIDE of the frame; GUIDE, a slide of the body
    pivot: Complexes  # in the frame; of a SLIDE the point of its line that is nearest to the origin
    pin: Complexes  # in the body; of a GUIDE the point of its line that is nearest to the body's origin
    normal: Complexes  # unit vector: of a SLIDE in the frame, of a GUIDE in the body; 1 of a LINK
    length: Floats  # of a LINK, else 0

    def __len__(self) -> int:
        return len(self.pivot)

    def take(self, rows: Any) -> Dyads:
        """Some of them, by a mask or by their numbers."""
        return Dyads(self.kind, self.pivot[rows], self.pin[rows], self.normal[rows], self.length[rows])


def rows(places: ArrayLike, rotations: ArrayLike) -> Floats:
    """The equation of each position, shape (..., positions, 8), of w, k, and x and y of X, A and q."""
    p, r = np.asarray(places, dtype=complex), np.asarray(rotations, dtype=complex)
    arm = 2 * np.conj(p) * r
    one = np.ones(p.shape)
    return np.stack(
        [np.abs(p) ** 2, one, arm.real, -arm.imag, -2 * p.real, -2 * p.imag, -2 * r.real, 2 * r.imag], axis=-1
    )


# The columns of the unknowns of the body and of the frame: a wish for a pin is one for a pivot, seen from the body.
BODY, FRAME = 2, 4
# What the unknowns of a kind of dyad do not have: w and one of X and A of slides.
_ABSENT = {LINK: (), SLIDE: (0, BODY, BODY + 1), GUIDE: (0, FRAME, FRAME + 1)}


def absent(kind: str) -> Floats:
    """The rows that make a dyad one of a kind, shape (rows, 8)."""
    return np.eye(8)[list(_ABSENT[kind])]


def on_lines(side: int, normals: Complexes, places: Complexes) -> Floats:
    """The wishes that a pivot or pin lies on the lines through places, shape (count, 1, 8)."""
    wish = np.zeros((len(places), 1, 8))
    wish[:, 0, 0] = -(np.conj(normals) * places).real
    wish[:, 0, side], wish[:, 0, side + 1] = normals.real, normals.imag
    return wish


def at_places(kind: str, side: int, places: Complexes) -> Floats:
    """The wishes for given pivots or pins, shape (count, 4, 8); (count, 2, 8) of slides, which have no other side."""
    wish, other = np.zeros((len(places), 4, 8)), BODY + FRAME - side
    x, y = places.real, places.imag
    wish[:, 0, 0], wish[:, 0, side] = -x, 1
    wish[:, 1, 0], wish[:, 1, side + 1] = -y, 1
    wish[:, 2, other], wish[:, 2, other + 1], wish[:, 2, 6] = x, y, -1
    sign = 1 if side == BODY else -1
    wish[:, 3, other], wish[:, 3, other + 1], wish[:, 3, 7] = sign * y, -sign * x, -1
    return wish if kind == LINK else wish[:, 2:]


def through(side: int, places: Complexes) -> Floats:
    """The wishes that slides of the frame or body run through places, shape (count, 1, 8)."""
    wish = np.zeros((len(places), 1, 8))
    wish[:, 0, 1], wish[:, 0, side], wish[:, 0, side + 1] = 0.5, -places.real, -places.imag
    return wish


def independent(equations: Floats) -> Floats:
    """Rows of length 1 that tell what equations tell, each something of its own; shape (rank, 8)."""
    size = np.linalg.norm(equations, axis=1, keepdims=True)
    _, sizes, right = np.linalg.svd(equations / np.where(size > 0, size, 1.0))
    return np.asarray(right[: np.count_nonzero(sizes > _DEPENDENT * sizes[0])])


def unknowns(equations: Floats) -> Floats:
    """All unknowns that fulfil rows of equations and w q = conj(A) X, shape (count, 8); rows have shape (..., m, 8).

    Five rows or seven; none where rows are dependent, since there are infinitely many then.
    """
    flat = equations.reshape(-1, *equations.shape[-2:])
    scale = np.linalg.norm(flat, axis=2, keepdims=True)
    _, sizes, right = np.linalg.svd(flat / np.where(scale > 0, scale, 1.0))
    right = right[sizes[:, -1] > _DEPENDENT * sizes[:, 0]]
    free = np.moveaxis(right[:, flat.shape[1] :], 1, 2)
    if free.shape[2] == 3:
        free = _points(free)
    w = free.reshape(-1, 8)
    w = w / np.abs(w).max(axis=1, keepdims=True)
    gap = np.abs(w[:, 0] * _complex(w, 6) - np.conj(_complex(w, 4)) * _complex(w, 2))
    return np.asarray(w[gap < _FULFILLED])


def _complex(w: Floats, k: int) -> Complexes:
    return w[..., k] + 1j * w[..., k + 1]


def quadrics(free: Floats) -> Floats:
    """The real and imaginary forms of w q - conj(A) X of unknowns that are sums of n, shape (count, 2, n, n)."""
    sums = np.swapaxes(free, 1, 2)
    w, a, x, q = sums[..., 0], np.conj(_complex(sums, 4)), _complex(sums, 2), _complex(sums, 6)
    form = w[:, :, None] * q[:, None] - a[:, :, None] * x[:, None]
    form = (form + np.swapaxes(form, 1, 2)) / 2
    return np.stack([form.real, form.imag], axis=1)


def _points(free: Floats) -> Floats:
    """The unknowns at the points in which two conics meet, shape (count, 8)."""
    free = free @ _TURN
    one, other = quadrics(free).swapaxes(0, 1)
    # Each is a u^2 + b u + c with polynomials in v of degree 0, 1, 2; their resultant has degree four.
    parts = []
    for m in (one, other):
        a, b = m[:, 0, 0, None], np.stack([2 * m[:, 0, 1], 2 * m[:, 0, 2]], axis=1)
        parts.append((a, b, np.stack([m[:, 1, 1], 2 * m[:, 1, 2], m[:, 2, 2]], axis=1)))
    (a, b, c), (d, e, f) = parts
    outer, left, inner = a * f - d * c, a * e - d * b, _product(b, f) - _product(e, c)
    quartic = _product(outer, outer) - _product(left, inner)
    lead = np.abs(quartic).max(axis=1)
    good = np.abs(quartic[:, 0]) > 1e-14 * lead
    free, one, other, quartic, outer, left = (x[good] for x in (free, one, other, quartic, outer, left))
    companion = np.zeros((len(quartic), 4, 4))
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[:, 0] = -quartic[:, 1:] / quartic[:, :1]
    v = np.linalg.eigvals(companion)
    # Two that nearly meet are a pair of complex numbers with small imaginary parts.
    lane, which = np.nonzero(np.abs(v.imag) < _NEARLY_REAL * (1 + np.abs(v)))
    v = v[lane, which].real
    bottom = left[lane, 0] * v + left[lane, 1]
    u = -((outer[lane, 0] * v + outer[lane, 1]) * v + outer[lane, 2]) / bottom
    u = np.where(np.isfinite(u), u, 0.0)
    point = np.stack([u, v, np.ones(len(v))], axis=1)
    point /= np.linalg.norm(point, axis=1, keepdims=True)
    for _ in range(_NEWTON_STEPS):
        g1, g2 = np.einsum("nij,nj->ni", one[lane], point), np.einsum("nij,nj->ni", other[lane], point)
        matrix = np.stack([2 * g1, 2 * g2, point], axis=1)
        side = np.stack([(g1 * point).sum(axis=1), (g2 * point).sum(axis=1), np.zeros(len(point))], axis=1)
        step, regular = np.zeros_like(point), np.abs(np.linalg.det(matrix)) > 1e-300
        step[regular] = np.linalg.solve(matrix[regular], side[regular, :, None])[..., 0]
        point = point - step
        point /= np.linalg.norm(point, axis=1, keepdims=True)
    w = np.einsum("nij,nj->ni", free[lane], point)
    # One of each that is there twice, by its lane.
    key = np.sign(w[np.arange(len(w)), np.abs(w).argmax(axis=1)])
    w = w * key[:, None] if len(w) else w
    keep = np.ones(len(w), dtype=bool)
    for k in range(1, len(w)):
        same = lane[:k] == lane[k]
        keep[k] = not (same & keep[:k] & (np.abs(w[:k] - w[k]).max(axis=1) < _SAME)).any()
    return np.asarray(w[keep])


def _product(one: Floats, other: Floats) -> Floats:
    """Products of polynomials, shape (count, degrees + 1)."""
    whole = np.zeros((len(one), one.shape[1] + other.shape[1] - 1))
    for k in range(one.shape[1]):
        whole[:, k : k + other.shape[1]] += one[:, k : k + 1] * other
    return whole


def links(w: Floats) -> Dyads:
    """The links with unknowns of shape (count, 8), of which w is not zero."""
    w = w / w[:, :1]
    pin, pivot = _complex(w, 2), _complex(w, 4)
    length = np.sqrt(np.maximum(np.abs(pin) ** 2 + np.abs(pivot) ** 2 - w[:, 1], 0.0))
    return Dyads(LINK, pivot, pin, np.ones(len(pin), dtype=complex), length)


def sliding(side: int, equations: Floats, normal: complex, place: complex) -> dict[str, Dyads]:
    """The slides that fulfil six rows, and whose point of the frame, or of the body, lies on a line: two at most.

    With the normal x of the slide the point is q x / |x|^2, or conj(q) x / |x|^2 of the frame: a quadratic equation.
    """
    free = np.linalg.svd(equations)[2][len(equations) :]
    x, q = _complex(free, BODY + FRAME - side), _complex(free, 6)
    form = np.outer(np.conj(normal) * (np.conj(q) if side == FRAME else q), x).real
    form -= (np.conj(normal) * place).real * np.outer(x, np.conj(x)).real
    # Unknowns are the first times cos t and the second times sin t: a sine of 2 t is given.
    middle, wide, skew = (form[0, 0] + form[1, 1]) / 2, (form[0, 0] - form[1, 1]) / 2, (form[0, 1] + form[1, 0]) / 2
    size = np.hypot(wide, skew)
    if not size > abs(middle):
        return dyads_of(np.empty((0, 8)))
    t = (np.arctan2(skew, wide) + np.array([1.0, -1.0]) * np.arccos(-middle / size)) / 2
    w = np.cos(t)[:, None] * free[0] + np.sin(t)[:, None] * free[1]
    return dyads_of(w / np.abs(w).max(axis=1, keepdims=True))


def dyads(equations: Floats) -> dict[str, Dyads]:
    """All dyads that fulfil rows of equations, shape (..., rows, 8); by their kinds."""
    return dyads_of(unknowns(equations))


def dyads_of(w: Floats) -> dict[str, Dyads]:
    """The dyads of unknowns, shape (count, 8); by their kinds."""
    weight, x, a, q = w[:, 0], _complex(w, 2), _complex(w, 4), _complex(w, 6)
    link = np.abs(weight) > NOTHING
    slide = ~link & (np.abs(x) <= np.sqrt(NOTHING)) & (np.abs(a) > np.sqrt(NOTHING))
    guide = ~link & (np.abs(a) <= np.sqrt(NOTHING)) & (np.abs(x) > np.sqrt(NOTHING))
    every = [links(w[link])]
    normal = a[slide] / np.abs(a[slide])
    offset = w[slide, 1] / (2 * np.abs(a[slide]))
    pin = q[slide] / np.conj(a[slide])
    every.append(Dyads(SLIDE, offset * normal, pin, normal, 0.0 * offset))
    normal = x[guide] / np.abs(x[guide])
    offset = w[guide, 1] / (2 * np.abs(x[guide]))
    pivot = np.conj(q[guide] / x[guide])
    every.append(Dyads(GUIDE, pivot, offset * normal, normal, 0.0 * offset))
    return {part.kind: part for part in every}

"""Which expressions are sums of their variables times constants."""

from __future__ import annotations

from mechdesign.expressions import Expression, arity


def is_linear(expression: Expression) -> bool:
    """Whether the derivatives of an expression are the same everywhere, as its form shows."""
    degrees: list[int] = []
    for kind, item in expression.program:
        if kind != "call":
            degrees.append(int(kind == "name"))
            continue
        count = arity(str(item))
        inner = degrees[-count:]
        del degrees[-count:]
        if item in ("+", "-", "negate"):
            degrees.append(max(inner))
        elif item == "*":
            degrees.append(sum(inner))
        else:
            # A quotient by a constant is linear; all else of a variable counts as not.
            degrees.append(inner[0] if item == "/" and not inner[1] else 2 * max(inner))
    return degrees[0] <= 1

"""How an expression is written: its text becomes a program, a step each constant, name and call."""

from __future__ import annotations

import re
from itertools import chain
from typing import Literal

from mechdesign.ground.errors import cut
from mechdesign.ground.functions import (
    BINDING,
    CONSTANTS,
    FUNCTIONS,
    OfOneNumber,
    arity,
)

# Longest text accepted, in characters, and its deepest nesting of parentheses.
MAX_TEXT = 1000
MAX_NESTING = 50
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
    r"|(?P<name>[^\W\d]\w*(?:\.\w+)*)"
    r"|(?P<operator>\*\*|[-+*/(),]))"
)


class ExpressionError(ValueError):
    """An expression that cannot be read or has no finite value; the message says why."""


_UNARY_BINDING = 30
# What an expression calls: a function by its name, a table, a motion law, or what makes it repeat.
Called = str | OfOneNumber
Step = tuple[Literal["constant", "name", "call"], float | Called]


def constant_step(value: float) -> tuple[Step, ...]:
    return (("constant", value),)


def call_steps(function: Called, arguments: list[tuple[Step, ...]]) -> tuple[Step, ...]:
    """The program of a call from those of its arguments."""
    return (*chain.from_iterable(arguments), ("call", function))


class Parser:
    """Precedence climbing over the tokens of one text; `**` binds more tightly than a sign, as in Python."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.program: list[Step] = []
        self.depth = 0
        self.tokens = self._tokenize(text)
        self.position = 0

    def parse(self) -> tuple[Step, ...]:
        if len(self.tokens) == 1:
            raise ExpressionError("an empty text where a number is expected")
        self._operand_chain(0)
        if self._peek()[0] != "end":
            raise self._unexpected()
        return tuple(self.program)

    @staticmethod
    def _tokenize(text: str) -> list[tuple[str, str]]:
        if len(text) > MAX_TEXT:
            raise ExpressionError(f"an expression longer than {MAX_TEXT} characters")
        tokens: list[tuple[str, str]] = []
        position, end = 0, len(text.rstrip())
        while position < end:
            match = _TOKEN.match(text, position)
            if match is None:
                rest = text[position:].lstrip()
                hint = "; powers are written **" if rest.startswith("^") else ""
                raise ExpressionError(f"{rest[0]!r} has no meaning in the expression {cut(text)!r}{hint}")
            tokens.append((str(match.lastgroup), match.group(str(match.lastgroup))))
            position = match.end()
        return [*tokens, ("end", "")]

    def _peek(self) -> tuple[str, str]:
        return self.tokens[self.position]

    def _take(self, operator: str) -> bool:
        if self._peek() == ("operator", operator):
            self.position += 1
            return True
        return False

    def _unexpected(self) -> ExpressionError:
        kind, token = self._peek()
        if kind == "end":
            return ExpressionError(f"the expression {cut(self.text)!r} ends too early")
        return ExpressionError(f"unexpected {token!r} in the expression {cut(self.text)!r}")

    def _operand_chain(self, binding: int) -> None:
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise ExpressionError(
                f"an expression nested deeper than {MAX_NESTING} levels; name its parts as parameters"
            )
        self._operand()
        while True:
            kind, token = self._peek()
            power = BINDING.get(token, -1) if kind == "operator" else -1
            if power <= binding:
                break
            self.position += 1
            # ** groups to the right: 2**3**2 is 2**9.
            self._operand_chain(power - 1 if token == "**" else power)
            self.program.append(("call", token))
        self.depth -= 1

    def _operand(self) -> None:
        kind, token = self._peek()
        if kind == "end" or token in (")", ",", "*", "/", "**"):
            raise self._unexpected()
        self.position += 1
        if token == "-":
            self._operand_chain(_UNARY_BINDING)
            self.program.append(("call", "negate"))
        elif token == "+":
            self._operand_chain(_UNARY_BINDING)
        elif token == "(":
            self._operand_chain(0)
            self._close()
        elif kind == "number":
            self.program.append(("constant", float(token)))
        elif self._take("("):
            self._call(token)
        elif token in CONSTANTS:
            self.program.append(("constant", CONSTANTS[token][0]))
        elif token in FUNCTIONS:
            raise ExpressionError(f"the function {token!r} needs its argument in parentheses")
        else:
            self.program.append(("name", token))

    def _call(self, name: str) -> None:
        if name not in FUNCTIONS:
            names = ", ".join(sorted(FUNCTIONS))
            raise ExpressionError(f"unknown function {name!r}; the functions are {names}")
        self._operand_chain(0)
        count = 1
        while self._take(","):
            self._operand_chain(0)
            count += 1
            if name in ("min", "max"):
                self.program.append(("call", name))
        self._close()
        if name in ("min", "max"):
            if count == 1:
                raise ExpressionError(f"{name} compares two numbers or more")
            return
        arguments = arity(name)
        if count != arguments:
            raise ExpressionError(f"{name} takes {arguments} number{'s' * (arguments > 1)}, not {count}")
        self.program.append(("call", name))

    def _close(self) -> None:
        if not self._take(")"):
            if self._peek()[0] == "end":
                raise ExpressionError(f"a parenthesis is not closed in the expression {cut(self.text)!r}")
            raise self._unexpected()

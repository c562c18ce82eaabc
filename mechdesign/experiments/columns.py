"""Tables of sweeps, sensitivities and runs and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.columns import CHOSEN, VARIED
from mechdesign.ground.results import KeyNumber, TableKind

SUMMARY = TableKind.of("summary", "what became of each question",
    ("study", "the study"), ("command", "the question"), ("outcome", "what became of it"),
    ("exit_code", "exit code that it would have by itself"), ("requirements", "requirements met, of all"),
    ("rows", "rows of its main table"), ("warnings", "how many warnings it gave"),
    ("directory", "where its results are"))  # fmt: skip
SWEEP = TableKind.of("sweep", "what becomes of each case of the matrix",
    ("case", "number of the case"), ("label", "name of the case, as its file gives it"),
    ("exit_code", "0 done, 1 a requirement not met, 3 impossible, 4 a numerical failure"),
    ("<entry>", VARIED, "as the entry"), ("<requirement>", "worst row; required is <limit>", "as the result"),
    ("<requirement>_met", "1 where the requirement is met"), ("<result>", CHOSEN, "as the result"),
    ("warnings", "number of warnings"), ("reason", "why the case failed"),
    ("rank", "1 the best of the cases that meet every requirement; nan of others"),
    ("front", "1 where none of these cases is as good in every goal and better in one"))  # fmt: skip
SENSITIVITIES = TableKind.of("sensitivities", "derivatives of results with respect to numbers of the study",
    ("result", "result of the study"), ("parameter", "number of the study that changes"),
    ("derivative", "of the result with respect to the parameter, in `unit`; nan at a kink and where it is not known"),
    ("error", "error estimate of the derivative, in `unit`"),
    ("unit", "unit of the derivative, as far as the study tells that of the parameter"),
    ("elasticity",
     "change of the result, in % of its size, for 1 % of the parameter's size more; nan where either is 0"),
    ("below", "slope below a kink, in `unit`; else nan"), ("above", "slope above a kink, in `unit`; else nan"),
    ("value", "the result, in its own unit"), ("value_unit", "unit of the result"),
    ("at", "the parameter, in its own unit"),
    ("at_unit", "unit of the parameter; empty where the study does not tell it"),
    ("settled", "1 where the differences agree"))  # fmt: skip
KEY_NUMBERS: tuple[KeyNumber, ...] = ()

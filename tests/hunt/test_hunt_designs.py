"""Designs at once against studies written out: numbers of every kind follow parameters, and nothing is lost.

A study is a template whose numbers, at random, become expressions over three parameters. Many designs of it are
evaluated together, and by `sweep`; each is also written out with plain numbers, loaded as a file of its own, and asked.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import mechdesign
from mechdesign.experiments.answered import Answered
from mechdesign.experiments.case_numbers import number_of
from mechdesign.experiments.cases import answers
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.results import Result
from mechdesign.motion.group import DesignGroup
from mechdesign.questions.optimize.question import designs_question

Seeds = Callable[[int], Iterator[int]]
NOMINAL = {"p": 10.0, "q": 20.0, "s": 5.0}
# Part by which parameters of designs differ from these.
WIDTH = 0.02
COUNT = 4
CLOSE = 1e-12
# Half of the digits of a number: so well is known where a smooth function is largest.
FLAT = 1e-8


class Number(float):
    """A number of a template that may follow parameters."""


def N(value: float) -> Number:
    return Number(value)


FOUR_BAR = {
    "mechanism": {
        "links": {
            "ground": {"O": [N(0), N(0)], "D": [N(100), N(5)]},
            "crank": {"from": "O", "to": "A", "length": N(30)},
            "rod": {"from": "A", "to": "B", "length": N(90), "points": {"C": [N(45), N(30)]}},
            "rocker": {"from": "D", "to": "B", "length": N(60)},
        },
        "drives": ["crank"],
        "sketch": {"A": [0, 30], "B": [75, 55]},
        "measures": {"mu": {"angle": ["rod", "rocker"]}},
    },
}
SLIDER_CRANK = {
    "mechanism": {
        "links": {
            "ground": {"O": [0, 0], "G": [N(1), N(-5)]},
            "crank": {"from": "O", "to": "A", "length": N(30)},
            "rod": {"from": "A", "to": "B", "length": N(100), "points": {"C": [N(50), N(10)]}},
            "slider": {"B": [0, 0]},
        },
        "joints": {"guide": {"prismatic": ["ground", "slider"], "through": "G", "direction": N(3)}},
        "drives": ["crank"],
        "sketch": {"A": [0, 30], "B": [95, -5]},
    },
}
FIVE_BAR = {
    "mechanism": {
        "links": {
            "ground": {"A": [N(0), N(0)], "E": [N(100), N(0)]},
            "la": {"from": "A", "to": "B", "length": N(120)},
            "lb": {"from": "B", "to": "C", "length": N(180)},
            "ra": {"from": "E", "to": "D", "length": N(120)},
            "rb": {"from": "D", "to": "C", "length": N(180)},
        },
        "drives": ["la", "ra"],
        "sketch": {"B": [-60, 100], "C": [50, 230], "D": [160, 100]},
    },
}


def angle_drive(rng: np.random.Generator) -> dict[str, Any]:
    """Poses of a crank, and what goes with them."""
    end = N(90) if rng.random() < 0.5 else N(340)
    asked = [
        {"sweep": {"crank": {"from": N(20), "to": end, "number": 13}}},
        {"sweep": {"crank": {"from": N(20), "to": N(99.5), "step": N(20)}}},
        {"poses": [{"crank": N(30)}, {"crank": N(70)}, {"crank": N(120)}]},
        {"path": {"crank": [N(10), N(30), N(60)]}},
        {},
    ]
    found: dict[str, Any] = dict(asked[rng.integers(len(asked))])
    if rng.random() < 0.5:
        found |= {"rates": {"crank": N(360)}, "accelerations": {"crank": N(20)}}
    if rng.random() < 0.5:
        found["loads"] = [{"at": "C", "force": [N(3), N(-20)]}, {"link": "rod", "moment": N(100)}]
    return found


def plane_drive(rng: np.random.Generator) -> dict[str, Any]:
    """Poses of a five-bar's point, and what goes with them."""
    at = [N(50), N(220)]
    asked = [
        {"sweep": {"C.x": N(50), "C.y": {"from": N(200), "to": N(240), "number": 11}}},
        {"sweep": {"C.x": {"from": N(40), "to": N(60), "number": 3}, "C.y": {"from": N(200), "to": 240, "number": 4}}},
        {"path": {"C": {"circle": {"center": at, "radius": N(20), "from": N(30)}, "points": 12}}},
        {"path": {"C": {"arc": {"center": at, "radius": N(20), "from": N(30), "to": N(170)}, "points": 9}}},
        {"path": {"C": {"line": [[N(40), N(200)], [N(70), N(240)]], "points": 7}}},
        {"path": {"C": [[N(40), N(200)], [N(50), N(220)], [N(70), N(215)]]}},
        {"path": {"C": {"through": [[N(40), N(200)], [N(50), N(220)], [N(70), N(215)]], "spline": True, "points": 8}}},
        {"poses": [{"C.x": N(50), "C.y": N(220)}, {"la": N(120), "ra": N(60)}]},
    ]  # fmt: skip
    found: dict[str, Any] = dict(asked[rng.integers(len(asked))])
    if "path" in found and rng.random() < 0.7:
        found["speed"] = N(100)
    elif rng.random() < 0.5:
        found["rates"] = {"la": N(10), "ra": N(-5)} if "poses" in found else {"C.x": N(10), "C.y": N(-5)}
    if rng.random() < 0.5:
        found["jacobian"] = ["C"]
    if rng.random() < 0.5:
        found["loads"] = [{"at": "C", "force": [N(3), N(-20)]}]
    return found


def with_targets(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Targets of kinematics: an expression, a table, a path."""
    given = [
        {"rocker.angle": "60 + 0.3*crank"},
        {"C": [[N(20), N(60)], [N(40), N(70)], [N(60), N(60)]]},
        {"rocker.angle": [[N(-20), N(60)], [N(180), N(100)], [N(400), N(150)]]},
    ]
    data["mechanism"]["targets"] = given[rng.integers(len(given))]


def template(rng: np.random.Generator) -> tuple[str, dict[str, Any]]:
    """A command and a study with numbers that may follow parameters."""
    kind = rng.integers(6)
    base = [FOUR_BAR, SLIDER_CRANK, FIVE_BAR, FOUR_BAR, SLIDER_CRANK, FIVE_BAR][kind]
    data: dict[str, Any] = copy.deepcopy(base)
    data["kinematics"] = plane_drive(rng) if base is FIVE_BAR else angle_drive(rng)
    if kind < 3:
        if base is FOUR_BAR and rng.random() < 0.5:
            with_targets(data, rng)
        if base is not FIVE_BAR and rng.random() < 0.3:
            data["mechanism"]["limits"] = [{"drive": "crank", "min": N(-10), "max": N(390)}]
        return "kinematics", data
    if rng.random() < 0.5:
        drive = {"la": N(1e5), "ra": N(2e5)} if base is FIVE_BAR else {"crank": [N(1e5), N(3e5)]}
        link = {"lb": "beam"} if base is FIVE_BAR else {"rocker": "beam"} if base is FOUR_BAR else {"crank": "beam"}
        data["stiffness"] = {
            "at": "C", "link": "lb" if base is FIVE_BAR else "rod", "actuators": drive, "elastic": link,
            "sections": {"beam": {"E": N(2e5), "width": N(10), "height": N(8)}},
            "bearings": {"B": {"radial": N(1e5)}}, "loads": [[N(10), N(-5), N(100)]], "direction": N(30),
            "characteristic_length": N(50),
        }  # fmt: skip
        return "stiffness", data
    first, second = ("la.length", "lb.length") if base is FIVE_BAR else ("crank.length", "rod.length")
    data["reliability"] = {
        "methods": ["analytic"], "outputs": ["C"],
        "dimensions": {first: N(0.05), second: {"sigma": N(0.02)}},
        "clearances": {"B": {"radial": N(0.03), "tolerance": N(0.01)}},
        "limits": {"C": {"radius": N(0.2)}, "C.x": [N(-0.1), N(0.12)]},
    }  # fmt: skip
    return "reliability", data


def following(data: Any, rng: np.random.Generator, share: float) -> Any:
    """The template with expressions in place of some numbers; each is the number itself at the nominal parameters."""
    if isinstance(data, dict):
        return {key: following(value, rng, share) for key, value in data.items()}
    if isinstance(data, list):
        return [following(value, rng, share) for value in data]
    if not isinstance(data, Number):
        return data
    if rng.random() > share:
        return float(data)
    name = str(rng.choice([*NOMINAL]))
    value = NOMINAL[name]
    if data == 0:
        return f"{name} - {value!r}"
    return f"{float(data)!r}*{name}/{value!r}" if rng.random() < 0.5 else f"{float(data) - 0.1 * value!r} + 0.1*{name}"


def written_out(data: Any, values: dict[str, float]) -> Any:
    """A study with plain numbers in place of its expressions over parameters."""
    if isinstance(data, dict):
        return {key: written_out(value, values) for key, value in data.items()}
    if isinstance(data, list):
        return [written_out(value, values) for value in data]
    if isinstance(data, str) and any(f"{name}" in data.replace("*", " ").replace("/", " ").split() for name in NOMINAL):
        return float(eval(data, {}, values))
    return data


def alone(command: str, data: dict[str, Any]) -> Result | None:
    """The answer of a study of its own; None where it has none."""
    try:
        result: Result = getattr(mechdesign, command)(mechdesign.load(data))
    except MechdesignError:
        return None
    return None if result.failed else result


def columns(command: str, result: Result) -> list[str]:
    """Names of numbers of a result, by which designs are compared."""
    main = [f"{command}.{c.name}" for c in result.main.columns if c.numeric and c.values.dtype.kind == "f"]
    more = []
    for name in ("extremes", "targets", "moments", "capability", "deflections", "compliance"):
        if name not in result.tables:
            continue
        table = result.tables[name]
        words = next((c for c in table.columns if not c.numeric and c.name != "unit"), None)
        row = f".{words.values[0]}" if words is not None else ""
        more += [f"{command}.{name}{row}.{c.name}" for c in table.columns if c.numeric and c.values.dtype.kind == "f"]
    return main + more


def same(one: float, other: float, name: str) -> bool:
    """Whether two numbers are equal to 1e-12 of their size, and of 1; places of extremes, which are flat, to 1e-8."""
    if np.isnan(one) or np.isnan(other) or not np.isfinite(other):
        return bool(np.array_equal(one, other, equal_nan=True))
    close = FLAT if name.endswith(("_at", ".at")) else CLOSE
    return abs(one - other) <= close * max(1.0, abs(other))


def test_designs_at_once_are_those_written_out(seeds: Seeds) -> None:
    compared = 0
    for seed in seeds(12):
        rng = np.random.default_rng([seed, 7])
        command, numbers = template(rng)
        data = following(numbers, rng, 0.5)
        data["mechanism"]["parameters"] = dict(NOMINAL)
        designs = {name: value * (1 + WIDTH * rng.uniform(-1, 1, COUNT)) for name, value in NOMINAL.items()}
        own = alone(command, data)
        if own is None:
            continue
        goals = [goal(name) for name in columns(command, own)]
        variables = {name: {"from": 0, "to": 1000} for name in NOMINAL}
        study = mechdesign.load(data | {"optimize": {"method": "search", "variables": variables, "minimize": "p"}})
        found = Evaluator(designs_question(study, goals))(designs)
        for k in range(COUNT):
            values = {name: float(column[k]) for name, column in designs.items()}
            plain = written_out(data, values)
            plain["mechanism"]["parameters"] = values
            result = alone(command, plain)
            # Where the study of its own fails, so does the design.
            assert (result is None) <= bool(found.reasons[k]), (seed, k)
            for j, each in enumerate(goals if result is not None else ()):
                (value,) = each.judge(result)[0]
                assert same(found.table[k, j], value, each.name), (seed, k, each.name, found.table[k, j], value)
                compared += 1
    assert compared


def leaves(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of the numbers of a template that may vary."""
    inside = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, each in inside:
        yield from leaves(each, (*path, key))
    if isinstance(data, Number):
        yield path


def test_cases_at_once_are_those_written_out(seeds: Seeds) -> None:
    compared = 0
    for seed in seeds(12):
        rng = np.random.default_rng([seed, 8])
        command, data = template(rng)
        own = alone(command, data)
        if own is None:
            continue
        paths = [*leaves(data)]
        varied = [paths[k] for k in rng.choice(len(paths), 3, replace=False)]
        cases = []
        for _ in range(COUNT):
            entries = {}
            for path in varied:
                value = data
                for key in path:
                    value = value[key]
                entries[".".join(map(str, path))] = float(value) * (1 + WIDTH * rng.uniform(-1, 1))
            cases.append(entries)
        names = [f"{name}.{word}" for name in columns(command, own)[:12] for word in ("min", "max")]
        wanted = [goal(name, single=True) for name in names]
        whole = Answered()
        for answered in answers(mechdesign.load(data), [tuple(entries.items()) for entries in cases], wanted):
            whole.add(answered)
        for k, entries in enumerate(cases):
            written = [f"{name}={value!r}" for name, value in entries.items()]
            try:
                result = getattr(mechdesign, command)(mechdesign.load(data, written))
            except MechdesignError as error:
                reason = str(error).splitlines()[0]
            else:
                reason = ""
            assert reason in whole.reason(k), (seed, whole.reason(k))
            if reason:
                continue
            assert whole.table[k, 1] == len(result.warnings), seed
            for kind in [kind for kind, warned in whole.warned.items() if warned.case == k]:
                first = next(warning for warning in result.warnings if warning.kind == kind)
                assert whole.warned[kind].message.startswith(f"{command}: {first}"), seed
            for j, each in enumerate(wanted):
                (expected,) = number_of(each, DesignGroup.alone(result))[0].tolist()
                assert same(whole.number(j)[0][k], expected, each.name), (seed, each.name, whole.number(j)[0][k])
                compared += 1
    assert compared

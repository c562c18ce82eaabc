"""A pin that gives has an end on every link: reliability, measures and stiffness mean the one that is named.

Expected are closed forms, and displacements of rigid links on springs by a small model of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.rigid_links import BOTH, RigidLinks
from helpers.stiffness import matrix
from helpers.studies import study_of
from scipy.special import ndtr

import mechdesign

SLIDER_CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 100], rod: [A, B, 250], slider: {B: [0, 0], T: [20, 10]}}
  joints: {guide: {prismatic: [ground, slider], through: O, point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [70, 70], B: [310, 0]}
  measures: {gap: slider.B.x - rod.B.x, reach: {distance: [O, slider.B]}, rod_end: {distance: [A, rod.B]},
             slider_end: {distance: [A, slider.B]}, both: 2*gap + slider.B.y}
stiffness: {link: slider, at: T, bearings: {B: 1000 N/mm}, poses: [{theta: 40}]}
reliability:
  poses: [{theta: 40}]
  dimensions: {load.fx: {sigma: 50}}
  load: [500, 0, 0]
  outputs: [slider.B, rod.B, T]
  methods: [analytic]
"""
FORCE = (30.0, -50.0)


@dataclass(frozen=True)
class Case:
    """A study of rigid links, the links at each of its pins, how far these give, and what else holds it."""

    text: str
    loaded: str
    pins: dict[str, tuple[str, ...]]
    springs: dict[str, float]
    rest: Callable[[RigidLinks, dict[str, complex]], None]

    def solve(self) -> tuple[Callable[[str], complex], dict[str, complex]]:
        """Displacements of points of links by their names, and places of the points; links before the pins."""
        study = study_of(self.text)
        solved = study.mechanism.solve(study.stiffness.poses[0])
        at = {point: complex(solved[f"{point}.x"], solved[f"{point}.y"]) for point in study.mechanism.points}
        moving = dict.fromkeys(link for joined in self.pins.values() for link in joined if link != "ground")
        compound = [point for point, joined in self.pins.items() if len(joined) > 2]
        links = RigidLinks([*moving, *compound])
        for point, joined in self.pins.items():
            for link in joined[1:] if point not in compound else joined:
                links.pin(point if point in compound else joined[0], link, at[point], self.springs.get(point))
        for pin in compound:
            links.hold(links.turns(pin))
        self.rest(links, at)
        link, point = self.loaded.split(".")
        moved = links.under(link, at[point], FORCE)

        def shift(name: str) -> complex:
            link, _, point = name.rpartition(".")
            return complex(*(links.moves(link or point, at[point], along) @ moved for along in BOTH))

        return shift, at


def crane(links: RigidLinks, at: dict[str, complex]) -> None:
    """The rod slides on the leg against the actuator's spring, and does not turn in it."""
    along = (at["M"] - at["D"]) / abs(at["M"] - at["D"])
    for way, stiffness in ((along, 2000.0), (1j * along, None)):
        links.hold(links.moves("leg", at["D"], way) - links.moves("rod", at["D"], way), stiffness)
    links.hold(links.turns("leg") - links.turns("rod"))


CASES = {
    "four-bar": Case("""
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 40]
    coupler: {from: A, to: B, length: 90, points: {C: [45, 30]}}
    rocker: [D, B, 70]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [80, 65]}
stiffness:
  {link: coupler, at: C, bearings: {O: 900, A: 500, B: 700, D: 2000}, actuators: {theta: 4e6}, poses: [{theta: 70}]}
""", "coupler.C",
        {"O": ("ground", "crank"), "A": ("crank", "coupler"), "B": ("coupler", "rocker"), "D": ("ground", "rocker")},
        {"O": 900, "A": 500, "B": 700, "D": 2000}, lambda links, at: links.hold(links.turns("crank"), 4e6)),
    # The knee K joins three links.
    "six-bar": Case("""
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0], E: [220, 40]}
    crank: [O, A, 40]
    rod: [A, K, 90]
    rocker: [D, K, 70]
    strut: [K, S, 80]
    arm: [E, S, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], K: [80, 65], S: [160, 70]}
stiffness: {link: strut, at: S, bearings: {A: 600, K: 500, S: 800}, poses: [{theta: 70}]}
""", "strut.S",
        {"O": ("ground", "crank"), "A": ("crank", "rod"), "D": ("ground", "rocker"), "E": ("ground", "arm"),
         "K": ("rod", "rocker", "strut"), "S": ("strut", "arm")},
        {"A": 600, "K": 500, "S": 800}, lambda links, at: links.hold(links.turns("crank"))),
    # The boom's pin M sits on the rod of a telescopic leg.
    "crane": Case("""
mechanism:
  links:
    ground: {O: [0, 0], D: [-100, -300]}
    boom: {O: [0, 0], M: [250, 20], T: [600, 0]}
    leg: {from: D, to: M, telescopic: true}
  drives: [leg]
  sketch: {T: [600, 0], M: [250, 0]}
stiffness: {link: boom, at: T, bearings: {O: 3000, M: 400}, actuators: {leg: 2000}, poses: [{boom.angle: 10}]}
""", "boom.T", {"O": ("ground", "boom"), "D": ("ground", "leg"), "M": ("boom", "rod")}, {"O": 3000, "M": 400}, crane),
}  # fmt: skip


def reliability(text: str, outputs: list[str], *overrides: str) -> mechdesign.Answer:
    poses = study_of(text).resolved["stiffness"]["poses"]
    section = {"poses": poses, "dimensions": {"load.fx": 1.0}, "load": [*FORCE, 0.0], "outputs": outputs,
               "methods": ["analytic"]}  # fmt: skip
    return mechdesign.reliability(study_of(text, f"reliability={section}", *overrides))


def shift(result: mechdesign.Answer) -> dict[str, float]:
    """Mean error of each output, to the first order."""
    table = result.tables["moments"]
    errors = (table["mean"] - table["nominal"]).tolist()
    return dict(zip(map(str, table["output"]), errors, strict=True))


def midway(result: mechdesign.Answer) -> list[str]:
    return [text for text in map(str, result.warnings) if "is midway" in text]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_every_link_has_its_own_end_of_a_pin(case: Case) -> None:
    expected, _ = case.solve()
    ends = {f"{link}.{point}".replace("rod.M", "leg.M"): f"{link}.{point}" for point, links in case.pins.items()
            for link in links if link != "ground" and point in case.springs}  # fmt: skip
    result = reliability(case.text, list(ends))
    found = shift(result)
    for name, end in ends.items():
        assert complex(found[f"{name}.x"], found[f"{name}.y"]) == pytest.approx(expected(end), rel=1e-7), name
    assert not midway(result)
    on = dict(zip(result.tables["contributions"]["output"], result.tables["contributions"]["on"], strict=True))
    assert on == {f"{name}.{axis}": name.split(".")[0] for name in ends for axis in "xy"}
    # The ends of every spring move apart, so that none of this is seen where they are taken for one.
    assert all(len({expected(end) for end in ends.values() if end.endswith(point)}) > 1
               for point, links in case.pins.items() if point in case.springs and "ground" not in links)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_plain_name_of_a_pin_is_midway_between_its_links_and_of_a_pin_on_the_ground_fixed(case: Case) -> None:
    expected, _ = case.solve()
    for point, links in case.pins.items():
        result = reliability(case.text, [point, case.loaded])
        found = shift(result)
        if "ground" in links:
            assert (found[f"{point}.x"], found[f"{point}.y"]) == (0.0, 0.0)
        elif f"{links[0]}.{point}" != case.loaded:
            middle = np.mean([expected(f"{link}.{point}") for link in links])
            assert complex(found[f"{point}.x"], found[f"{point}.y"]) == pytest.approx(middle, rel=1e-7), point
            (text,) = midway(result)
            names = " and ".join(f"{link}.{point}" for link in links).replace("rod.M", "leg.M")
            assert text.startswith(f"{point}.x, {point}.y: the pin {point} gives, ")
            assert f"between its ends {names}; " in text
            if len(links) == 3:
                assert expected(point) == pytest.approx(middle, rel=1e-7)


@pytest.mark.parametrize("theta", [-100, 0, 40, 75, 130])
def test_the_spring_in_a_slider_cranks_rod(theta: float) -> None:
    """The rod bears S = F / cos b along itself; its end gives way across it, and the slider along its guide."""
    b, spring, force = np.arcsin(0.4 * np.sin(np.radians(theta))), 1000.0, 500.0
    result = mechdesign.reliability(
        study_of(SLIDER_CRANK, f"reliability.poses=[{{theta: {theta}}}]", "reliability.outputs=[slider.B, rod.B, T, B]")
    )
    found, slider, rod = shift(result), force / spring / np.cos(b) ** 2, force / spring * np.tan(b) ** 2
    expected = {
        "slider.B.x": slider, "slider.B.y": 0.0, "T.x": slider, "T.y": 0.0, "rod.B.x": rod,
        "rod.B.y": force / spring * np.tan(b), "B.x": (slider + rod) / 2, "B.y": force / spring * np.tan(b) / 2,
    }  # fmt: skip
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["analytic", "second_order", "monte_carlo", "form", "auto"])
def test_a_limit_is_of_the_end_that_it_names(method: str) -> None:
    """The slider's end errs by F / (k cos^2 b) with F of 500 +- 50: 0.3 is far below, and 0.6 hardly above."""
    slider = 1 / 1000 / (1 - (0.4 * np.sin(np.radians(40))) ** 2)
    for limit, name in ((0.3, "slider.B.x"), (0.6, "slider.B.x"), (0.6, "T.x"), (0.6, "rod.B.x")):
        study = study_of(
            SLIDER_CRANK, f"reliability.limits={{{name}: {limit}}}", "reliability.outputs=",
            f"reliability.methods={method}", "reliability.samples=20000",
        )  # fmt: skip
        table = mechdesign.reliability(study).tables["reliability"]
        expected = 1.0 if name == "rod.B.x" else ndtr((limit / slider - 500) / 50)
        assert table["reliability"][0] == pytest.approx(
            expected, abs=0.02 if method in ("monte_carlo", "auto") else 1e-3
        )
    disc = study_of(SLIDER_CRANK, "reliability.limits={slider.B: {radius: 0.6}, rod.B: {radius: 0.6}}")
    assert mechdesign.reliability(disc).tables["reliability"]["reliability"][0] == pytest.approx(
        ndtr((0.6 / slider - 500) / 50), abs=1e-3
    )


def test_measures_are_of_the_ends_that_they_name() -> None:
    tangent = np.tan(np.arcsin(0.4 * np.sin(np.radians(40))))
    names = "[gap, reach, rod_end, slider_end, both]"
    found = shift(mechdesign.reliability(study_of(SLIDER_CRANK, f"reliability.outputs={names}")))
    # The rod is rigid; the spring lengthens it by the force along it over its stiffness.
    assert found == pytest.approx(
        {"gap": 0.5, "reach": 0.5 * (1 + tangent**2), "rod_end": 0.0, "slider_end": 0.5 * np.hypot(1, tangent),
         "both": 1.0}, rel=1e-9, abs=1e-11,
    )  # fmt: skip
    result = mechdesign.kinematics(study_of(SLIDER_CRANK, "kinematics={poses: [{slider.B.x: 300}], "
                                            "outputs: [slider.B, rod.B.x, gap, reach]}"))  # fmt: skip
    motion = result.tables["motion"]
    assert [motion[name][0] for name in ("slider.B.x", "slider.B.y", "rod.B.x", "gap", "reach")] == pytest.approx(
        [300, 0, 300, 0, 300]
    )


def test_ends_of_a_pin_that_does_not_give_are_one() -> None:
    result = mechdesign.reliability(
        study_of(SLIDER_CRANK, "stiffness.bearings={}", "reliability.outputs=[B, rod.B, slider.B]")
    )
    assert list(shift(result)) == [f"{end}.{axis}" for end in ("B", "rod.B", "slider.B") for axis in "xy"]
    assert list(shift(result).values()) == pytest.approx([0.0] * 6, abs=1e-12)
    assert not midway(result)


def test_a_measure_of_a_plain_pin_that_gives_is_told() -> None:
    change = "mechanism.measures={reach: {distance: [O, B]}}"
    result = mechdesign.reliability(study_of(SLIDER_CRANK, change, "reliability.outputs=[reach, T]"))
    (text,) = midway(result)
    assert text.startswith("reach: the pin B gives")
    rigid = study_of(SLIDER_CRANK, change, "reliability.outputs=[reach]", "stiffness.bearings={}")
    assert not midway(mechdesign.reliability(rigid))


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_stiffness_of_an_end(case: Case) -> None:
    """A force on the end itself; with its link as a body the same, and a moment besides."""
    for point, links in case.pins.items():
        for link in links:
            if link == "ground":
                continue
            end, body = f"{link}.{point}".replace("rod.M", "leg.M"), "leg" if link == "rod" and point == "M" else link
            moved = Case(case.text, f"{link}.{point}", case.pins, case.springs, case.rest).solve()[0]
            expected = moved(f"{link}.{point}")
            force = f"stiffness.loads={[[*FORCE, 0.0]]}"
            for asked in ("", body):
                result = mechdesign.stiffness(
                    study_of(case.text, f"stiffness.at={end}", f"stiffness.link={asked}", force)
                )
                table = result.tables["deflections"]
                found = complex(table["dx"][0], table["dy"][0])
                assert len(matrix(result, "C")) == (3 if asked else 2)
                assert found == pytest.approx(expected, rel=1e-7, abs=1e-12), (end, asked)
                assert matrix(result, "C")[:2, :2] @ FORCE == pytest.approx([expected.real, expected.imag], abs=1e-9)


def test_the_asked_pin_is_that_of_the_stiffness_section() -> None:
    """Without a link it bears the load itself, midway between two springs; asked of a link, it is the link's end."""
    text = SLIDER_CRANK.replace("at: T", "at: B")
    for change in ("stiffness.link=", "stiffness.link=slider", "stiffness.link=rod"):
        study = study_of(text, change, "stiffness.loads=[[500, 0, 0]]", "reliability.outputs=[B]")
        table, result = mechdesign.stiffness(study).tables["deflections"], mechdesign.reliability(study)
        assert shift(result) == pytest.approx({"B.x": table["dx"][0], "B.y": table["dy"][0]}, rel=1e-7, abs=1e-12)
        assert not midway(result)
        assert set(result.tables["contributions"]["on"]) == {change.split("=")[1] or "rod slider"}


@pytest.mark.slow
@pytest.mark.parametrize(("changes", "message"), [
    (["stiffness.at=ground.O", "stiffness.link="], "belongs to the ground"),
    (["stiffness.at=rod.B"], "link 'slider' has no point 'rod.B'"),
    (["stiffness.at=crank.B"], "no point 'crank.B'"),
    (["stiffness.at=rod.B.x"], "the name of a point"),
    (["mechanism.measures={gap: {distance: [rod.B, slider.B]}}", "reliability.outputs=[T]"], "slider.B.x - rod.B.x"),
    (["mechanism.measures={gap: {distance: [O, crank.B]}}", "reliability.outputs=[T]"], "no point 'crank.B'"),
    (["mechanism.measures={gap: crank.B.x}", "reliability.outputs=[T]"], "'crank.B.x'"),
    (["reliability.outputs=[crank.B]"], "link 'crank' has no point 'B'"),
    (["reliability.limits={rod.B.x: 1, slider.B.x: 1}", "stiffness.bearings={}"], "limited twice"),
])  # fmt: skip
def test_what_cannot_be_meant_is_refused(changes: list[str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(SLIDER_CRANK, *changes)


CLEARANCE = [
    "stiffness=", "reliability.load=", "reliability.dimensions=", "reliability.clearances={B: {radial: 0.3}}",
    "mechanism.measures={rod_end: {distance: [A, rod.B]}, slider_end: {distance: [A, slider.B]}}",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("outputs", ["slider.B.x, T", "rod.B.x, T", "T, rod_end", "T, slider_end"])
def test_a_pin_with_a_clearance_has_the_same_two_ends(outputs: str) -> None:
    """An offset d along the rod moves the slider by d / cos b, one across the guide the rod's end by d tan b.

    Whichever end is asked, the slider stays on its guide, and errs as much.
    """
    b, sigma = np.arcsin(0.4 * np.sin(np.radians(40))), 0.1
    methods = "reliability.methods=[analytic, second_order, monte_carlo]"
    result = mechdesign.reliability(study_of(SLIDER_CRANK, *CLEARANCE, f"reliability.outputs=[{outputs}]", methods))
    table = result.tables["moments"]
    x = sigma / np.cos(b)
    wanted = {"slider.B.x": [x], "rod.B.x": [sigma * np.tan(b)], "T": [x, 0.0], "rod_end": [0.0], "slider_end": [sigma]}
    expected = [value for name in outputs.split(", ") for value in wanted[name]]
    for method, rel in (("analytic", 1e-9), ("second_order", 1e-4), ("monte_carlo", 0.02)):
        assert table["sigma"][table["method"] == method] == pytest.approx(expected, rel=rel, abs=1e-9)
    assert not any("has a clearance" in text for text in map(str, result.warnings))


@pytest.mark.parametrize("outputs", ["rod.B.x, slider_end", "rod_end, slider_end", "both"])
def test_measures_of_two_ends_of_a_clearance_are_refused(outputs: str) -> None:
    more = "mechanism.measures.both=slider.B.x - rod.B.x"
    with pytest.raises(mechdesign.StudyError, match="all outputs and limits mean one of them"):
        study_of(SLIDER_CRANK, *CLEARANCE, more, f"reliability.outputs=[{outputs}]")


@pytest.mark.slow
@pytest.mark.parametrize("link", ["rod", "slider"])
def test_a_pin_with_a_clearance_that_gives_is_of_one_link_for_both(link: str) -> None:
    alone = shift(mechdesign.reliability(study_of(SLIDER_CRANK)))
    for changes in (
        [f"reliability.outputs=[{link}.B]"],
        ["reliability.outputs=[B]", f"reliability.clearances.B.link={'rod' if link == 'slider' else 'slider'}"],
    ):
        found = shift(mechdesign.reliability(study_of(SLIDER_CRANK, "reliability.clearances.B.radial=0.3", *changes)))
        assert found == pytest.approx({f"B.{axis}": alone[f"{link}.B.{axis}"] for axis in "xy"}, abs=1e-12)

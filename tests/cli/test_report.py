"""`--report`: a page a study and an index, whole in one file, whatever became of the questions."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from mechdesign.door.report.page import printing
from mechdesign.ground.errors import AssemblyError, Interrupted
from mechdesign.questions.kinematics.analysis import kinematics

from .conftest import SLIDER, answer

HOSTILE = """</script><img src=x onerror=alert(1)>'"&"""
STIFF = """\
stiffness:
  link: rod
  at: B
  sections: {beam: {E: 200 GPa, area: 100, inertia: 1000}}
  elastic: {rod: beam}
requirements:
  - {result: kinematics.B.x, at_least: 90}
  - {result: stiffness.k_x, at_least: 1}
"""
FINE = (
    SLIDER.replace("to: 90, step: 45", "to: 360, step: 1") + "  rates: {theta: 10 rad/s}\n  outputs: [B, rod.angle]\n"
)
VOID = {"meta", "img", "br", "link", "input", "hr", "wbr"}


class Page(HTMLParser):
    """A page taken apart: its elements in order with their attributes, their texts, and what is nested wrongly."""

    def __init__(self, path):
        super().__init__()
        self.bytes = Path(path).read_bytes()
        self.text = self.bytes.decode()
        self.elements, self.texts, self.open, self.wrong = [], {}, [], []
        self.feed(self.text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append((tag, len(self.elements) - 1))

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop()[0] != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if self.open:
            for _, number in self.open:
                self.texts[number] = self.texts.get(number, "") + data

    def all(self, tag):
        return [attributes for each, attributes in self.elements if each == tag]

    def said(self, tag):
        return [self.texts.get(number, "") for number, (each, _) in enumerate(self.elements) if each == tag]


def check(page):
    """What holds of every page, whatever is in it."""
    assert not page.wrong
    assert not page.open
    # Nothing is asked of anybody: no address but the name of SVG, and a policy that names what may style and run.
    assert "http" not in page.text.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")
    policy = next(each["content"] for each in page.all("meta") if each.get("http-equiv"))
    assert "default-src 'none'" in policy
    scripts = [
        page.texts[number]
        for number, (tag, attributes) in enumerate(page.elements)
        if tag == "script" and attributes.get("type") != "application/json"
    ]
    for kind, found in (("style-src", page.said("style")), ("script-src", scripts)):
        assert len(found) == (f"{kind} " in policy)
        for text in found:
            assert f"{kind} 'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'" in policy
    assert not [key for _, attributes in page.elements for key in attributes if key.startswith("on") or key == "style"]
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    named = re.findall(r'(?:(?:href|aria-labelledby)="#?|url\(#)([\w.-]+)["\)]', page.text)
    assert {name for name in named if not name.endswith(".html")} <= set(ids)
    assert all(each.get("alt") for each in page.all("img"))
    assert all(each.get("aria-label") or each.get("aria-hidden") for each in page.all("svg"))
    assert all(each.get("scope") for each in page.all("th"))
    assert len(page.all("caption")) == len(page.all("table"))
    assert page.said("title") == page.said("h1") or page.said("title") == ["Design studies"]


@pytest.fixture
def asks(folder):
    (folder / "both.yaml").write_text(SLIDER.replace("step: 45", "step: 15") + STIFF)
    return folder


def test_a_page_holds_all_of_a_study(asks, invoke):
    with (asks / "both.yaml").open("a") as stream:
        stream.write("  - {result: kinematics.extremes.range, at_most: 50, where: {output: B.x}}\n")
    done = invoke("run", "both.yaml", "--report")
    assert done.exit_code == 1
    page = Page("results/both/report.html")
    check(page)
    headings = page.said("h2")
    assert headings[:3] == ["Answers", "Requirements", "Mechanism"]
    assert {"How does it move?", "How stiff is it?"} <= set(headings)
    motion = json.loads(Path("results/both/kinematics/manifest.json").read_text())["tables"]["motion.csv"]["columns"]
    heads = page.said("th")
    for column in motion:
        assert f"{column['name']} [{column['unit']}]" in heads or (not column["unit"] and column["name"] in heads)
        assert {"scope": "col", "class": "number", "title": column["meaning"]} in page.all("th")
    # With the crank up B is at sqrt(120^2 - 60^2), at 0 deg at 40 + sqrt(120^2 - 20^2).
    cells = page.said("td")
    first, last = cells.index("✓ met"), cells.index("✗ not met")
    assert cells[first + 1 : first + 5] == ["≥ 90 mm", "103.9 mm", "+13.92 mm", "theta 90"]
    assert cells[last + 1 : last + 4] == ["≤ 50 mm", "54.4 mm", "−4.399 mm"]
    assert "2 of 3 requirements met" in page.text


@pytest.mark.nightly
def test_the_same_study_gives_the_same_page(folder, invoke):
    for out in ("one", "two"):
        invoke("run", "slider.yaml", "--report", "--out", out)
    assert Path("one/report.html").read_bytes() == Path("two/report.html").read_bytes()


@pytest.mark.nightly
def test_a_page_of_kept_questions_is_whole(folder, analysis, invoke):
    computed = []
    analysis(lambda study, **options: computed.append(study) or kinematics(study))
    page = folder / "results/slider/report.html"
    invoke("run", "slider.yaml", "--report")
    first = page.read_bytes()
    page.unlink()
    invoke("run", "slider.yaml", "--report", "--resume")
    assert len(computed) == 1
    assert page.read_bytes() == first
    # A question that has left nothing for a page is asked again.
    invoke("run", "slider.yaml")
    assert not page.exists()
    assert not (folder / "results/slider/kinematics/report.json").exists()
    invoke("run", "slider.yaml", "--report", "--resume")
    assert len(computed) == 3
    assert page.read_bytes() == first
    check(Page(page))


@pytest.mark.nightly
def test_a_fine_motion_with_its_curves_is_small(folder, invoke):
    (folder / "fine.yaml").write_text(FINE)
    done = invoke("kinematics", "fine.yaml", "--report")
    assert done.exit_code == 0, done.output
    page = Page("results/fine/kinematics/report.html")
    check(page)
    assert len(page.bytes) < 300_000
    assert "the first 8 of 361 rows" in page.text
    for words in ("range of B.x", "largest velocity of rod.angle"):
        assert words in page.said("dt")


def test_what_a_study_says_stays_text(folder, invoke):
    folder.joinpath("<b>.yaml").write_text(SLIDER.replace("Offset slider-crank", json.dumps(HOSTILE)))
    done = invoke("run", "<b>.yaml", "slider.yaml", "--report", "--no-plots")
    assert done.exit_code == 0, done.stderr
    # A folder's name has no letter that a system forbids.
    for path in ("results/_b_/report.html", "results/index.html"):
        page = Page(path)
        check(page)
        assert not [each for each in page.all("img") if "onerror" in each]
        assert HOSTILE in (page.said("h1") if "report" in path else page.said("a"))
    assert "_b_/report.html" in [each["href"] for each in Page("results/index.html").all("a")]


@pytest.mark.nightly
def test_an_index_tells_of_every_study(asks, analysis, invoke):
    def fail(study, **options):
        raise AssemblyError("cannot reach <there>")

    analysis(fail, "stiffness")
    (asks / "wrong.yaml").write_text(SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]"))
    done = invoke("run", "both.yaml", "wrong.yaml", "slider.yaml", "--report")
    assert done.exit_code == 3, done.stderr
    page = Page("results/index.html")
    check(page)
    rows = [" ".join(text.split()) for text in page.said("tr")][1:]
    assert "stiffness: ✗ cannot be assembled" in rows[0]
    assert "✗ NOT MET0 of 2 requirements met" in rows[0]
    assert "wrong study" in rows[1]
    assert "mechanism.links.crank" in rows[1]
    assert "kinematics: ✓ doneno warnings" in rows[2]
    assert [each["href"] for each in page.all("a")] == ["both/report.html", "slider/report.html"]
    assert len(page.all("img")) == 2
    failed = Page("results/both/report.html")
    check(failed)
    assert "cannot be assembled: cannot reach <there>" in " ".join(failed.said("p"))
    assert "not judged" in failed.text


def test_an_index_begins_with_what_is_not_met_and_has_key_numbers(asks, invoke):
    for name, limit in (("c", 30), ("a", 30), ("b", 200), ("z", 200)):
        gate = f"requirements: [{{result: kinematics.extremes.B.x.range, at_least: {limit}}}]\n"
        (asks / f"{name}.yaml").write_text(SLIDER.replace("Offset slider-crank", name) + gate)
    studies = [f"{name}.yaml" for name in ("c", "z", "slider", "a", "b")]
    done = invoke("run", *studies, "--report", "--no-plots", "--out", "all")
    assert done.exit_code == 1, done.stderr
    page = Page("all/index.html")
    check(page)
    assert [each["href"].partition("/")[0] for each in page.all("a")] == ["b", "z", "a", "c", "slider"]
    assert [cell.split(" ")[0] for cell in page.said("td")[1::4]] == ["✗", "✗", "✓", "✓", "nothing"]
    assert page.said("li")[0].startswith("range of A.x: 40")
    assert "2 not met" in " ".join(page.said("span"))


def test_the_index_of_an_interrupted_run_names_the_studies_that_were_not_answered(asks, analysis, invoke):
    def interrupt(study, **options):
        raise KeyboardInterrupt

    analysis(interrupt, "stiffness")
    (asks / "last.yaml").write_text(SLIDER)
    done = invoke("run", "slider.yaml", "both.yaml", "last.yaml", "--report", "--no-plots", "--jobs", 1)
    assert done.exit_code == 130
    page = Page("results/index.html")
    check(page)
    rows = [" ".join(text.split()) for text in page.said("tr")][1:]
    assert len(rows) == 3
    assert "✗ interrupted" in rows[0]
    assert "✗ not answered" in rows[1]
    assert "✓ done" in rows[2]
    assert not [*Path("results").glob(".*.tmp")]


def test_an_interrupted_run_leaves_a_page_of_what_was_finished(asks, analysis, invoke):
    def interrupt(study, **options):
        raise KeyboardInterrupt

    analysis(interrupt, "stiffness")
    done = invoke("run", "both.yaml", "slider.yaml", "--report", "--jobs", 1)
    assert done.exit_code == 130
    assert "report: " not in done.output, done.output
    page = Page("results/both/report.html")
    check(page)
    assert "✗ interrupted" in " ".join(page.said("p"))
    assert "motion.csv" in page.text
    assert not Path("results/slider").exists()


def test_the_finished_part_of_an_interrupted_question_is_in_its_page(folder, analysis, invoke):
    def interrupt(study, **options):
        raise Interrupted(answer(interrupted="2 of 3 poses"))

    analysis(interrupt)
    for command in (["kinematics"], ["run"]):
        done = invoke(*command, "slider.yaml", "--report", "--out", "out")
        assert done.exit_code == 130
        page = Page("out/report.html")
        check(page)
        assert "✗ interrupted: 2 of 3 poses" in page.said("p")
        assert "all 3 rows" in page.said("caption")
        assert {"The sketch, assembled"} == {each["aria-label"] for each in page.all("svg")}


def test_questions_after_a_failure_stand_as_not_asked(asks, analysis, invoke):
    analysis(lambda study, **options: answer(failed="no pose"))
    invoke("run", "both.yaml", "--report", "--fail-fast")
    page = Page("results/both/report.html")
    check(page)
    assert "✗ not asked: the run ended before it" in page.said("p")


def test_a_page_without_pictures_says_so(folder, invoke):
    done = invoke("kinematics", "slider.yaml", "--report", "--no-plots")
    assert done.exit_code == 0
    page = Page("results/slider/kinematics/report.html")
    check(page)
    assert "without pictures, as was asked (--no-plots)" in page.text
    assert not page.all("svg")


def test_an_older_page_goes_and_one_of_others_stays(folder, invoke):
    own = folder / "results/slider/report.html"
    invoke("run", "slider.yaml", "--report", "--no-plots")
    assert own.exists()
    invoke("run", "slider.yaml", "--no-plots")
    assert not own.exists()
    own.write_text("<p>mine")
    invoke("run", "slider.yaml", "--no-plots")
    assert own.exists()


def test_without_a_browser_a_printed_report_is_refused_before_anything_is_computed(folder, invoke, monkeypatch):
    monkeypatch.setattr(printing, "BROWSERS", ("no-such-browser",))
    for command in ("run", "kinematics"):
        done = invoke(command, "slider.yaml", "--report", "pdf")
        assert done.exit_code == 2
        assert "no browser to print with; install Chromium, Chrome or Edge" in done.stderr
    assert not (folder / "results").exists()
    assert "--report takes pdf or nothing, not 'png'" in invoke("run", "slider.yaml", "--report=png").stderr


def test_a_browser_prints_the_report_and_an_older_print_goes(folder, invoke, monkeypatch):
    browser = folder / "chromium"
    browser.write_text("""#!/bin/sh
for word; do case $word in --print-to-pdf=*) printf '%%PDF-1.4 (D:20261127101010)\\n' > "${word#*=}";; esac; done
""")
    browser.chmod(0o755)
    monkeypatch.setattr(printing, "BROWSERS", (str(browser),))
    printed = folder / "results/slider/report.pdf"
    done = invoke("run", "--report", "pdf", "slider.yaml", "--no-plots")
    assert done.exit_code == 0, done.stderr
    assert f"printed in {printed.relative_to(folder)}" in done.stderr
    assert printed.read_bytes().startswith(b"%PDF-1.4 (D:19700101000000)\n")
    manifest = json.loads((folder / "results/slider/kinematics/manifest.json").read_text())
    assert manifest["report"] is True
    # Without a kind it is the page alone, and a study may follow.
    assert invoke("run", "--report", "slider.yaml", "--no-plots").exit_code == 0
    assert printed.with_name("report.html").exists()
    assert not printed.exists()
    printed.write_bytes(b"%PDF mine")
    assert "no result of mechdesign's" in invoke("run", "slider.yaml", "--report", "pdf", "--no-plots").stderr
    assert printed.read_bytes() == b"%PDF mine"
    printed.unlink()
    browser.write_text("#!/bin/sh\necho no display >&2\nexit 1\n")
    done = invoke("run", "slider.yaml", "--report", "pdf", "--no-plots")
    assert done.exit_code == 4
    assert "did not print it: no display" in done.stderr


def test_a_study_whose_tables_are_all_wide_has_a_report(folder, invoke):
    weighed = "mechanism.links.slider={points: {B: [0, 0]}, mass: 2}"
    moving = "dynamics={rates: {theta: 60 rpm}}"
    done = invoke("dynamics", "slider.yaml", "--no-plots", "--report", "--set", weighed, "--set", moving)
    assert done.exit_code == 0, done.output
    assert "largest joint force" in next(folder.rglob("report.html")).read_text(encoding="utf-8")


def test_a_report_of_a_mechanism_that_bears_nothing_moves(folder, invoke):
    (folder / "idle.yaml").write_text("""
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
  friction: {A: {coefficient: 0.1, radius: 5}}
dynamics: {sweep: {crank: {from: 0, to: 360, step: 30}}, rates: {crank: 60 rpm}}
""")
    done = invoke("dynamics", "idle.yaml", "--report", "--out", "out")
    assert done.exit_code == 0
    assert "cannot be shown moving" not in done.stderr

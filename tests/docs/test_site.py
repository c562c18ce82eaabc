"""The site: it builds without a warning, every command and option is in it, and it asks for nothing from anywhere."""

from __future__ import annotations

import fcntl
import re
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import typer.main

from mechdesign.door.cli.app import app

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ROOT = Path(__file__).parents[2]
AWAY = re.compile(r"\s*(?:https?:)?//")
IN_STYLE = re.compile(r"""(?:url\(|@import)\s*['"]?\s*(?:https?:)?//[^)'"]*""")
# What a browser loads by itself; an `a` waits for a click.
LOADED = {"src", "srcset", "href", "data", "poster", "action"}
# Words of the field, and the page that a search for each shows first.
WORDS = {
    "backlash": "tutorials/tolerances", "play": "tutorials/tolerances", "slop": "tutorials/tolerances",
    "pin": "tutorials/tolerances", "tolerance stack": "tutorials/tolerances", "torque": "howto/torque",
    "stroke": "howto/stroke_and_timing", "swing": "howto/swing_tolerance", "baseline": "howto/batch",
    "dead centre": "theory/kinematics", "dead center": "theory/kinematics", "toggle": "theory/kinematics",
    "mechanical advantage": "theory/kinematics", "Grashof": "theory/kinematics", "Jacobian": "theory/kinematics",
    "manipulability": "theory/workspace", "friction": "howto/friction", "Cpk": "howto/standard_grades",
}  # fmt: skip


class Requests(HTMLParser):
    """What a page makes a browser ask for from another place."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if tag != "a" and name in LOADED and AWAY.match(value or ""):
                self.found.append(f"{tag} {value}")
            if name == "style":
                self.found += IN_STYLE.findall(value or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-n", "-W", "-q", "-d", str(folder / "doctrees"), str(ROOT / "docs")]
    # Two workers of the tests would run the pages' examples in one folder.
    with (Path(tempfile.gettempdir()) / "mechdesign-site.lock").open("w") as lock:
        fcntl.lockf(lock, fcntl.LOCK_EX)
        done = subprocess.run(
            [*command, str(folder / "html")], capture_output=True, text=True, check=False, timeout=400
        )
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.nightly
def test_the_site_asks_for_nothing_from_anywhere(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 80
    for page in pages:
        requests = Requests()
        requests.feed(page.read_text(encoding="utf-8"))
        assert requests.found == [], page
    for style in site.rglob("*.css"):
        assert IN_STYLE.findall(style.read_text(encoding="utf-8")) == [], style


@pytest.mark.nightly
def test_every_command_and_option_is_in_the_site(site: Path) -> None:
    text = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    for name, command in typer.main.get_command(app).commands.items():
        part = text.partition(f"mechdesign {name} ")[2].partition("Usage: ")[0]
        for given in command.params:
            assert given.metavar in part if given.param_type_name == "argument" else given.opts[0] in part, name


def test_a_request_would_be_found() -> None:
    requests = Requests()
    requests.feed('<a href="https://a.b/"></a><img src="//a.b/c.png"><p style="background: url(https://a.b/d)">')
    assert requests.found == ["img //a.b/c.png", "url(https://a.b/d"]


@pytest.mark.nightly
@pytest.mark.browser
def test_a_search_for_a_word_of_the_field_shows_its_page_first(site: Path, browser: Browser) -> None:
    page = browser.new_page()
    first = {}
    for word in WORDS:
        page.goto(f"{(site / 'search.html').as_uri()}?q={word}")
        link = page.wait_for_selector("#search-results li a")
        first[word] = link.get_attribute("href").partition(".html")[0]
    assert first == WORDS


@pytest.mark.nightly
def test_thumbnails_are_small(site: Path) -> None:
    sizes = {
        path.name: path.stat().st_size for path in (site / "_images").glob("*.svg") if "@keyframes" in path.read_text()
    }
    assert len(sizes) > 40
    # The largest shows two linkages, a geared five-bar and its four-bar.
    assert max(sizes.values()) < 22_000
    assert sum(sizes.values()) < 9_000 * len(sizes)

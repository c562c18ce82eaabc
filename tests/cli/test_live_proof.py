"""The live page proved: a drag in mechanisms of every kind, the command around it, hostile texts, memory."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import socket
import subprocess
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from helpers.live_page import FOUR_BAR, commanded, interrupted
from typer.testing import CliRunner

from mechdesign import load
from mechdesign.door.cli.app import app

try:
    from playwright.sync_api import expect
except ImportError:
    expect = None

pytestmark = pytest.mark.browser

CONFIGS = Path(__file__).parents[2] / "configs"
FIVE_BAR = """\
mechanism:
  links: {ground: {A: [-50, 0], B: [50, 0]}, left: [A, D, 90], left_rod: [D, P, 120],
    right: [B, E, 90], right_rod: [E, P, 120]}
  drives: {q1: {angle: left}, q2: {angle: right}}
  sketch: {D: [-90, 80], E: [90, 80], P: [0, 160]}
workspace: {point: P}
"""


def forty_links():
    """Nineteen parallelograms side by side: 40 links with the ground."""
    pins = "".join(f", D{k}: [{100 * k}, 0]" for k in range(1, 20))
    links = [f"ground: {{D0: [0, 0]{pins}}}", "crank: [D0, A0, 40]"]
    links += [f"rod{k}: [A{k - 1}, A{k}, 100], rocker{k}: [D{k}, A{k}, 40]" for k in range(1, 20)]
    sketch = ", ".join(f"A{k}: [{100 * k}, 40]" for k in range(20))
    return (
        f"mechanism: {{links: {{{', '.join(links)}}}, drives: {{theta: {{angle: crank}}}}, sketch: {{{sketch}}}}}\n"
        "kinematics: {sweep: {theta: {from: 60, to: 120, step: 5}}, outputs: [rocker19.angle]}\n"
    )


def shipped(name):
    return (CONFIGS / f"{name}.yaml").read_text()


# A study of each kind, and a point that is dragged in it.
KINDS = {
    "six-bar": (shipped("gallery/watt"), "F"),
    "five-bar": (FIVE_BAR, "B"),
    "cam": (shipped("gallery/cam_dwell"), "N"),
    "forty links": (forty_links(), "D7"),
    "dynamics": (shipped("gallery/flywheel_press"), "A"),
}


def numbers_of(page):
    """Key numbers as a page shows them, by their names, of each question."""
    return page.evaluate("""() => Object.fromEntries([...document.querySelectorAll("[data-question]")].map(part => [
        part.dataset.question, Object.fromEntries([...part.querySelectorAll("dl.numbers > div")].map(entry => [
            entry.querySelector("dt").firstChild.textContent, entry.querySelector(".value").textContent]))]))""")


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_a_drag_in_any_mechanism_is_saved_and_the_command_line_gives_the_numbers_of_the_page(live, tmp_path, kind):
    text, point = KINDS[kind]
    one = live(text)
    before = numbers_of(one.page)
    one.drag(point, 9, -6)
    assert one.page.locator(".live-number.changed").count() + one.said.inner_text().count("=") > 0
    shown = numbers_of(one.page)
    assert shown != before
    out, copy = tmp_path / "out", one.save_as("changed.yaml")
    done = CliRunner().invoke(app, ["run", str(copy), "--report", "--no-plots", f"--out={out}"])
    assert done.exit_code in (0, 1, 3), done.stderr
    answers = [json.loads(part.read_text()) for part in out.rglob("report.json")]
    assert answers
    for answer in answers:
        told = {number["label"]: number["value"] for number in answer["headlines"]}
        assert shown[answer["command"]] == told


HOSTILE = "<img src=x onerror=alert(1)>"


@pytest.mark.nightly
def test_hostile_texts_stay_texts(live):
    text = f'name: "{HOSTILE}"\n{FOUR_BAR}'
    bar = live(text, name=f"{HOSTILE}.yaml".replace(" ", "&nbsp;"))
    bar.page.on("dialog", lambda dialog: bar.complaints.append(dialog.message))
    assert HOSTILE in bar.page.locator("h1").inner_text()
    bar.drag("D", 10, 0)
    bar.press("Save into")
    bar.press("Cancel")
    bar.edit(text.replace("[D, B, 60]", f'[D, B, "{HOSTILE}"]'))
    expect(bar.page.locator(".live-message")).to_contain_text(HOSTILE)
    assert bar.page.locator("img[onerror], img[src=x]").count() == 0


@pytest.mark.nightly
def test_the_command_serves_until_ctrl_c_and_says_how_many_pages_were_open(browser, tmp_path):
    path = tmp_path / "bar.yaml"
    path.write_text(FOUR_BAR)
    with commanded(path) as (process, address):
        pages = [browser.new_page() for _ in range(2)]
        for page in pages:
            page.goto(address)
            page.wait_for_selector("#kinematics .numbers")
        path.write_text(FOUR_BAR.replace("[D, B, 60]", "[D, B, 64]"))
        for page in pages:
            expect(page.locator("[data-name='rocker.length'] [role=spinbutton]")).to_have_value("64")
            page.wait_for_selector("#kinematics .numbers")
        path.unlink()
        path.mkdir()
        expect(pages[0].locator(".live-message")).to_contain_text("bar.yaml")
        path.rmdir()
        path.write_text(FOUR_BAR)
        for page in pages:
            expect(page.locator("[data-name='rocker.length'] [role=spinbutton]")).to_have_value("60")
            page.wait_for_selector("#kinematics .numbers")
        assert "ended; 2 pages open" in interrupted(process)
        assert process.returncode == 0
        for page in pages:
            page.close()


@pytest.mark.nightly
def test_a_command_that_is_started_again_has_another_address_and_the_old_page_says_so(browser, tmp_path):
    path = tmp_path / "bar.yaml"
    path.write_text(FOUR_BAR)
    page = browser.new_page()
    with commanded(path) as (process, address):
        port = re.search(r":(\d+)/", address)[1]
        page.goto(address)
        page.wait_for_selector("#kinematics .numbers")
        interrupted(process)
    expect(page.locator(".live-message")).to_contain_text("open its new address")
    with commanded(path, f"--port={port}") as (_, again):
        assert again != address
        page.wait_for_timeout(2500)
        expect(page.locator(".live-message")).to_contain_text("open its new address")
        page.goto(again)
        page.wait_for_selector("#kinematics .numbers")
    page.close()


def test_a_port_that_is_taken_is_told_and_there_is_no_other_host(tmp_path):
    path = tmp_path / "bar.yaml"
    path.write_text(FOUR_BAR)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = CliRunner().invoke(app, ["live", str(path), "--no-browser", f"--port={port}"])
    assert done.exit_code == 2
    assert f"--port {port}: Address already in use" in done.stderr
    done = CliRunner().invoke(app, ["live", str(path), "--host=0.0.0.0"])
    assert done.exit_code == 2
    assert "no such option: --host" in done.stderr


@pytest.mark.nightly
@pytest.mark.parametrize("options", [(), ("--no-browser",)], ids=["browser", "no browser"])
def test_the_browser_is_opened_by_a_file_that_only_its_owner_can_read_or_not_at_all(tmp_path, options):
    path, told = tmp_path / "bar.yaml", tmp_path / "told"
    path.write_text(FOUR_BAR)
    script = tmp_path / "browser"
    script.write_text(f'#!/bin/sh\nfile="${{1#file://}}"\n{{ echo "$1"; stat -c %a "$file"; cat "$file"; }} > {told}\n')
    script.chmod(0o700)
    command = [sys.executable, "-m", "mechdesign", "live", str(path), *options]
    environment = os.environ | {"BROWSER": str(script)}
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        address = process.stderr.readline().partition("live at ")[2].split()[0]
        threading.Event().wait(1.0)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    finally:
        process.kill()
        process.communicate()
    if options:
        assert not told.exists()
        return
    words, rights, content = told.read_text().split("\n", 2)
    assert address.split("/")[-2] not in words
    assert (rights, address in content) == ("600", True)
    # The file is gone with the command.
    assert not Path(words.removeprefix("file://")).exists()


@pytest.mark.nightly
def test_two_hundred_random_drags_end_without_an_exception_and_the_memory_stays(browser, tmp_path):
    path, generator = tmp_path / "bar.yaml", random.Random(7)
    path.write_text(FOUR_BAR)
    with commanded(path) as (process, address):
        page, complaints = browser.new_page(viewport={"width": 1300, "height": 900}, reduced_motion="reduce"), []
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(address)
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable")
        used = []
        for count in range(201):
            # No handle of an element is kept, which would keep the element.
            page.locator("#kinematics :is(.numbers, .failed)").first.wait_for()
            if count % 50 == 0:
                used.append(memory_of(page, session, process))
            if count == 200:
                break
            box = page.locator(f".live-handle[data-at={generator.choice('ODABP')}]").bounding_box()
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(
                x + generator.uniform(-90, 90), y + generator.uniform(-90, 90), steps=generator.randrange(1, 8)
            )
            page.mouse.up()
            page.wait_for_timeout(generator.choice([0, 20, 250]))
            if generator.random() < 0.3:
                page.locator(f"[data-do={generator.choice(['undo', 'redo', 'reset', 'fit'])}]:enabled").or_(
                    page.locator("[data-do=fit]")
                ).first.click()
        assert complaints == []
        # The first fifty fill what is kept.
        assert all(now < 1.3 * then for now, then in zip(used[-1], used[1], strict=True))
        assert "ended; 1 page open" in interrupted(process)
        page.close()


def memory_of(page, session, process):
    """Memory of a server (kB), and of its page once all is answered: its heap (bytes), nodes and listeners."""
    page.wait_for_timeout(500)
    page.locator("[aria-busy=true]").first.wait_for(state="detached", timeout=30_000)
    session.send("HeapProfiler.collectGarbage")
    numbers = {entry["name"]: entry["value"] for entry in session.send("Performance.getMetrics")["metrics"]}
    resident = int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text())[1])
    return resident, *(numbers[name] for name in ("JSHeapUsedSize", "Nodes", "JSEventListeners"))


@pytest.mark.nightly
def test_a_notebook_of_another_origin_shows_the_page_in_which_a_point_is_dragged(browser, tmp_path):
    frame = load(text=FOUR_BAR).live()
    (tmp_path / "notebook.html").write_text(f"<!doctype html><h1>Notebook</h1>{frame._repr_html_()}")
    handler = partial(SimpleHTTPRequestHandler, directory=tmp_path)
    handler.log_message = lambda *_: None
    notebook = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=notebook.serve_forever, daemon=True).start()
    try:
        page = browser.new_page(viewport={"width": 1300, "height": 1000}, reduced_motion="reduce")
        page.goto(f"http://localhost:{notebook.server_port}/notebook.html")
        inside = page.frame_locator("iframe")
        inside.locator("#kinematics .numbers").wait_for()
        box = inside.locator(".live-handle[data-at=D]").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 20, y, steps=4)
        page.mouse.up()
        expect(inside.locator("[data-name='ground.D.x']")).to_have_class(re.compile("changed"))
        page.close()
    finally:
        notebook.shutdown()
        notebook.server_close()
        frame.close()

"""The live page of a study, as hands use it in a browser."""

from __future__ import annotations

import signal
import subprocess
import sys
from contextlib import contextmanager

from helpers.studies import COMMENTED_FOUR_BAR
from mechdesign import load
from mechdesign.door.live.server import LiveServer
from mechdesign.door.live.task import session_of

FOUR_BAR = f"""\
{COMMENTED_FOUR_BAR}kinematics: {{outputs: [P, rocker.angle], rates: {{theta: 60 rpm}}}}
requirements: [{{result: kinematics.rocker.angle, at_most: 160}}]
"""


class Live:
    """A page of a study's server."""

    def __init__(self, browser, path, **looks):
        self.path, self.session = path, session_of(load(path), lambda: load(path))
        self.server = LiveServer(self.session)
        self.server.start()
        self.complaints = []
        self.page = self.open(browser, **looks)

    def open(self, browser, **looks):
        page = browser.new_page(**{"viewport": {"width": 1300, "height": 900}, "reduced_motion": "reduce", **looks})
        page.on("console", lambda message: self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(self.server.url)
        self.answered(page)
        return page

    @staticmethod
    def answered(page):
        """Wait until every question is answered by the numbers as they are."""
        page.wait_for_selector(".live-answer:not([aria-busy])", timeout=30_000)
        page.wait_for_selector(".live-answer[aria-busy=true]", state="detached", timeout=30_000)

    def middle(self, point):
        box = self.page.locator(f".live-handle[data-at={point}]").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def hold(self, point):
        """Take a point by the mouse; returns where it is on the screen."""
        x, y = self.middle(point)
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        return x, y

    def touch(self, point, across):
        """Take a point by a finger and move it by pixels to the right; returns what lets it go."""
        x, y = self.middle(point)
        session = self.page.context.new_cdp_session(self.page)

        def send(kind, *points):
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [*points]})

        send("touchStart", {"x": x, "y": y})
        for k in range(1, 6):
            send("touchMove", {"x": x + across * k / 5, "y": y})
        return lambda: send("touchEnd")

    def drag(self, point, across, down):
        """Take a point by the mouse, move it by pixels and let it go."""
        x, y = self.hold(point)
        self.page.mouse.move(x + across / 2, y + down / 2, steps=4)
        self.page.mouse.move(x + across, y + down, steps=4)
        self.page.mouse.up()
        self.page.wait_for_selector(".live-handle.held", state="detached")
        self.answered(self.page)

    def field(self, name):
        """The field of a number."""
        return self.page.locator(f"[data-name='{name}'] [role=spinbutton]")

    def value(self, name):
        return float(self.field(name).input_value())

    def type(self, name, value):
        """Type a number into its field and leave it."""
        self.field(name).fill(value)
        self.field(name).blur()
        self.answered(self.page)

    @property
    def said(self):
        """What the page says of what a hand has done."""
        return self.page.locator(".live-said")

    def press(self, button):
        """Click a button of the page."""
        self.page.get_by_role("button", name=button, exact=button == "Save").click()

    def save_as(self, name):
        """Save a copy of the study; its path."""
        self.press("Save as")
        self.page.get_by_label("Name of the file").fill(name)
        self.press("Save")
        self.page.locator(".live-said", has_text=f"Saved as {name}").wait_for()
        return self.path.with_name(name)

    def edit(self, text):
        """Write the file as an editor does, and have it read."""
        self.path.write_text(text)
        self.session.reload()

    @property
    def scale(self):
        """Pixels of the screen per length of the study."""
        return self.page.evaluate("""() => {
            const {drawing, data} = document.getElementById("kinematics-moving").moving;
            return data().scale * drawing.getBoundingClientRect().width / drawing.viewBox.baseVal.width; }""")

    def close(self):
        for page in self.page.context.pages:
            page.close()
        self.server.close()


@contextmanager
def commanded(path, *options):
    """`mechdesign live` in a process of its own, and the address of its page."""
    command = [sys.executable, "-m", "mechdesign", "live", str(path), "--no-browser", *options]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        yield process, process.stderr.readline().partition("live at ")[2].split()[0]
    finally:
        process.kill()
        process.communicate()


def interrupted(process):
    """What a command says when Ctrl-C ends it."""
    process.send_signal(signal.SIGINT)
    return process.communicate(timeout=20)[1]

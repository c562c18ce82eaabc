"""Makes the pictures of the live page in a browser: real drags at the four-bar of the README, and a task's linkages.

    python docs/live_picture.py

Needs Playwright and a browser (``pip install -e '.[browser]'``; Debian: chromium-headless-shell). Each frame is what
the browser shows after a step of the hand, once the server has answered it.
"""

from __future__ import annotations

import cmath
import io
import math
import re
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

import mechdesign
from mechdesign.door.live.server import LiveServer
from mechdesign.door.live.task import session_of

DOCS = Path(__file__).parent
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
SIZE, SCALE = (1080, 590), 0.75  # of the page, and pixels of the picture in one of the page
STEP, PAUSE = 110, 1100  # milliseconds of a frame, and of one at which a reader looks longer
COLORS = 80
POINTER = """() => {
  const pointer = document.createElement("div");
  pointer.id = "pointer";
  pointer.innerHTML = '<svg width="22" height="26" viewBox="0 0 22 26"><path d="M2 1v19l5-4 4 9 4-2-4-8h7z" \
fill="#222" stroke="white" stroke-width="1.5"/></svg>';
  Object.assign(pointer.style, {position: "fixed", zIndex: 9, pointerEvents: "none", left: "520px", top: "400px"});
  document.body.append(pointer);
}"""
MOVE = "([x, y]) => Object.assign(document.getElementById('pointer').style, {left: `${x}px`, top: `${y}px`})"
# Where a place of the study stands on the screen.
PLACE = """([x, y]) => {
  const {drawing, data} = document.getElementById("kinematics-moving").moving, {corner, scale} = data();
  const box = drawing.getBoundingClientRect(), pixels = box.width / drawing.viewBox.baseVal.width;
  return [box.left + (x - corner[0]) * scale * pixels, box.top + (corner[1] - y) * scale * pixels];
}"""


def study_text() -> str:
    """The study in ten lines, as it stands in the README."""
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```yaml\n(.*?)```", readme, re.DOTALL)
    return next(f"name: Crank-rocker\n{block}" for block in blocks if "rocker.angle" in block)


class Film:
    """The frames of a page on which a hand drags."""

    def __init__(self, page: Page) -> None:
        self.page, self.at = page, (520.0, 400.0)
        self.frames: list[Image.Image] = []
        self.times: list[int] = []

    def take(self, time: int = STEP) -> None:
        """A frame of what the page shows now."""
        self.frames.append(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB"))
        self.times.append(time)

    def move(self, x: float, y: float, steps: int, *, drags: bool = False) -> None:
        """The pointer goes to a place of the screen in some steps."""
        (begin_x, begin_y), self.at = self.at, (x, y)
        for k in range(1, steps + 1):
            share = k / steps
            there = [begin_x + share * (x - begin_x), begin_y + share * (y - begin_y)]
            self.page.evaluate(MOVE, there)
            self.page.mouse.move(*there)
            if drags:
                self.page.wait_for_timeout(250)
            self.take()

    def drag(self, point: str, places: list[complex], steps: int) -> None:
        """A point is dragged by places of the study, in some steps from each to the next, and let go."""
        box = self.page.locator(f".live-handle[data-at={point}]").bounding_box()
        assert box is not None
        self.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, 3)
        self.page.mouse.down()
        for place in places:
            self.move(*self.page.evaluate(PLACE, [place.real, place.imag]), steps, drags=True)
        self.times[-1] = PAUSE
        self.page.mouse.up()
        answered(self.page)
        self.take(PAUSE)


def answered(page: Page) -> None:
    """Wait until every question is answered."""
    page.wait_for_timeout(300)
    page.wait_for_selector(".live-answer[aria-busy=true]", state="detached")


def drags(page: Page) -> None:
    """Write the film of drags at the four-bar of the README."""
    page.evaluate(POINTER)
    film = Film(page)
    film.take(PAUSE)
    # Round the crank's circle, then pins and a pivot, whose dimensions are named beside the hand.
    film.drag("A", [30 * cmath.exp(1j * math.radians(angle)) for angle in range(10, 101, 10)], 1)
    film.drag("B", [66 + 66j], 8)
    page.evaluate("document.getElementById('kinematics').scrollIntoView()")
    film.take(PAUSE)
    film.drag("D", [116 - 4j, 92 - 4j], 6)
    film.times[-1] = 2 * PAUSE
    # One palette for all, so that a frame holds what has changed alone.
    few = film.frames[:: len(film.frames) // 6]
    sheet = Image.new("RGB", (few[0].width, few[0].height * len(few)))
    for k, frame in enumerate(few):
        sheet.paste(frame, (0, k * frame.height))
    palette = sheet.quantize(COLORS, dither=Image.Dither.NONE)
    first, *rest = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in film.frames]
    first.save(DOCS / "live.gif", save_all=True, append_images=rest, duration=film.times, loop=0, optimize=True)


def linkages(page: Page) -> None:
    """Write a picture of a task with its linkages side by side."""
    page.set_viewport_size({"width": SIZE[0], "height": 820})
    page.locator(".live-handle").nth(4).focus()
    image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    image.quantize(COLORS, dither=Image.Dither.NONE).save(DOCS / "live_task.png", optimize=True)


def main() -> None:
    """Write the pictures."""
    program = next(filter(None, map(shutil.which, BROWSERS)))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "study.yaml"
        path.write_text(study_text(), encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        for file, show in ((path, drags), (DOCS.parent / "configs/gallery/five_positions.yaml", linkages)):
            server = LiveServer(session_of(mechdesign.load(file)))
            server.start()
            page = browser.new_page(
                viewport={"width": SIZE[0], "height": SIZE[1]}, device_scale_factor=SCALE, reduced_motion="reduce"
            )
            page.goto(server.url)
            page.wait_for_selector(".live-answer:not([aria-busy])")
            answered(page)
            show(page)
            page.close()
            server.close()
        browser.close()


if __name__ == "__main__":
    main()

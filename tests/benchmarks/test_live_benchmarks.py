"""How long a hand waits at the live page: README's four-bar, in a browser, as multiples of an empty round trip.

Targets on an idle machine: positions by the next frame but one, the kinematics answer within 60 ms.
"""

from __future__ import annotations

import subprocess
import sys
from statistics import median

from helpers.studies import of_readme

MOVES, ANSWERS, EMPTY = 40, 15, 60
FRAME = 1000 / 60  # ms

# Notes when what is asked of the server has come into the page, and when the frame that shows it begins.
WATCH = """() => {
  window.noted = {move: [], answer: [], pointer: 0};
  const fetched = window.fetch, next = () => new Promise(requestAnimationFrame);
  const ring = document.querySelector(".live-handle[data-at=D]");
  ring.addEventListener("pointermove", event => noted.pointer = event.timeStamp, true);
  window.fetch = async (action, ...rest) => {
    const begin = performance.now(), pointer = noted.pointer;
    const answer = await fetched(action, ...rest), json = answer.json.bind(answer);
    answer.json = async () => {
      const value = await json();
      if (noted[action]) next().then(frame => noted[action].push([performance.now() - begin, frame - pointer]));
      return value;
    };
    return answer;
  };
}"""
ANSWERED = """async count => {
  const busy = () => noted.answer.length <= count || document.querySelector("[aria-busy=true]");
  while (busy()) await new Promise(resolve => setTimeout(resolve, 20));
}"""
EMPTY_TRIPS = """async count => {
  const times = [];
  for (let k = 0; k < count; k++) {
    const begin = performance.now();
    await (await fetch("progress/none")).json();
    times.push(performance.now() - begin);
  }
  return times;
}"""


def test_a_hand_at_the_study_in_the_readme(benchmark, browser, tmp_path) -> None:
    (tmp_path / "study.yaml").write_text(of_readme())
    command = [sys.executable, "-m", "mechdesign", "live", "study.yaml", "--no-browser"]
    server = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    page = browser.new_page(viewport={"width": 1300, "height": 900}, reduced_motion="reduce")
    try:
        page.goto(server.stderr.readline().partition("live at ")[2].split()[0])
        page.wait_for_selector("#kinematics .live-answer:not([aria-busy])")
        page.evaluate(WATCH)
        field = page.locator("[data-name='rocker.length'] [role=spinbutton]")

        def answer() -> None:
            count = page.evaluate("noted.answer.length")
            field.fill(str(60 + 0.1 * (count % 9 + 1)))
            page.evaluate(ANSWERED, count)

        benchmark.pedantic(answer, rounds=ANSWERS, warmup_rounds=2)
        box = page.locator(".live-handle[data-at=D]").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.evaluate("noted.move = []")
        for k in range(MOVES):
            page.mouse.move(x + 0.4 * k, y)
            page.wait_for_timeout(80)
        page.mouse.up()
        empty = median(page.evaluate(EMPTY_TRIPS, EMPTY))
        moves, answers = (page.evaluate(f"noted.{action}") for action in ("move", "answer"))
    finally:
        page.close()
        server.terminate()
        server.communicate()
    answered, shown = median(time for time, _ in answers), median(time for _, time in moves)
    benchmark.extra_info |= {
        "empty round trip (ms)": round(empty, 2),
        "kinematics answer (ms)": round(answered, 1),
        "kinematics answer (empty round trips)": round(answered / empty, 1),
        "pointer to picture (ms)": round(shown, 1),
        "pointer to picture (frames)": round(shown / FRAME, 2),
        "pointer to picture (empty round trips)": round(shown / empty, 1),
    }
    print(benchmark.extra_info)
    assert len(moves) > MOVES / 2

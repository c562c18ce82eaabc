"""Python in a browser: no processes, no threads, no packages that Pyodide does not have, and questions are answered."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import pytest

# What such a Python lacks is taken away before the package is imported.
LACKING = """
import multiprocessing.util, os, subprocess, sys, sysconfig, threading

sysconfig.get_config_vars()
for name in ("typer", "rich", "click", "shellingham", "junitparser", "moocore", "psutil", "dask", "distributed"):
    sys.modules[name] = None


def refused(*arguments, **options):
    raise OSError("neither processes nor threads")


sys.platform = "emscripten"
del os.fork
threading.Thread.start = subprocess.Popen.__init__ = multiprocessing.util.spawnv_passfds = refused
"""
ASKED = """
import json
import mechdesign

study = mechdesign.load(text='''
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {outputs: [rocker.angle]}
reliability: {dimensions: {"*.length": 0.05}, poses: [{crank: 90}], limits: {rocker.angle: 0.1}, samples: 2000}
''')
motion, made = mechdesign.kinematics(study), mechdesign.reliability(study)
shown = [len(answer._repr_html_()) for answer in (study, motion, made)]
print(json.dumps([motion.tables["extremes"]["range"][0], made.tables["reliability"]["reliability"][0], shown]))
"""


@pytest.mark.nightly
def test_questions_are_answered_and_shown_without_processes_threads_and_the_command_lines_packages() -> None:
    done = subprocess.run([sys.executable, "-c", LACKING + ASKED], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    swing, reliability, shown = json.loads(done.stdout)
    # Dead centres: the rod stretched and folded over the crank.
    angles = [math.acos((100**2 + 60**2 - length**2) / (2 * 100 * 60)) for length in (90 + 30, 90 - 30)]
    assert swing == pytest.approx(math.degrees(angles[0] - angles[1]), rel=1e-9)
    assert 0.9 < reliability < 1
    assert min(shown) > 10_000

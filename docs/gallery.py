"""A page for every shipped study: what its opening comment says, its picture, the file itself, the command."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
CONFIGS = ROOT / "configs"
# Where a study belongs, in the order of the page. Every study is in one group: a test counts them.
GROUPS = {
    "Four-bars": ("four_bar", "parallelogram", "wiper", "pumpjack", "function_generator", "path_synthesis",
                  "straight_line_synthesis", "straight_line_front"),
    "Sliders": ("slider_crank", "offset_slider_crank", "inverted_slider_crank", "oscillating_cylinder", "scotch_yoke",
                "whitworth", "shaper", "oldham", "trammel", "rapson_slide", "v_twin", "sine_generator",
                "rise_dwell_return"),
    "Six-bars and more": ("watt", "stephenson", "stephenson_ii", "jansen", "klann", "toggle", "toggle_clamp",
                          "scissor_lift", "excavator"),
    "Straight lines": ("chebyshev", "hoeken", "hart", "peaucellier", "watt_parallel_motion", "pantograph"),
    "Robots": ("five_bar", "two_rpr", "two_rrr", "two_rpr_printed", "two_rrr_printed", "robot_arm", "scara",
               "rrr_platform", "rrr_orientations"),
    "Reliability": ("two_link_arm", "two_link_arm_uniform", "slider_crank_tolerances", "function_generator_made",
                    "bored_in_one_setting", "cheapest_tolerances", "one_in_a_billion", "five_bar_precision_map"),
    "Stiffness": ("planar_3rpr", "planar_2rpr_rp", "planar_rp_rr", "press_stiffness", "stiffness_map", "loaded_arm"),
}  # fmt: skip
# The picture that says most, where there are several; paths of a group without one.
PICTURES = ("optimum", "allocation", "deflections", "failure_map", "density_contours", "springs", "workspace", "paths",
            "bands", "density", "reliability")  # fmt: skip


def studies() -> dict[str, Path]:
    """Every shipped study by its name."""
    return {path.stem: path for path in sorted(CONFIGS.rglob("*.yaml"))}


def _opening(text: str) -> list[str]:
    """The lines of the comment that a study opens with."""
    lines = text.splitlines()
    return lines[: next(number for number, line in enumerate(lines) if not line.startswith("#"))]


def comment(text: str) -> str:
    """The opening comment of a study as Markdown: paragraphs, and indented lines as they stand."""
    lines = [line[1:].removeprefix(" ") for line in _opening(text)]
    return re.sub(r"(?m)(?:^ {2,}\S.*\n?)+", _block, "\n".join(lines) + "\n")


def _block(found: re.Match[str]) -> str:
    lines = [line.strip() for line in found.group().splitlines()]
    kind = "sh" if lines[0].startswith("mechdesign ") else "text"
    return "\n".join((f"```{kind}", *lines, "```", ""))


def picture(results: Path) -> Path | None:
    """The picture of a study's results that says most."""
    found = {path.stem: path for path in sorted(results.rglob("*.png"))}
    return next((found[name] for name in PICTURES if name in found), None)


def page(path: Path) -> str:
    """The page of one study."""
    text = path.read_text(encoding="utf-8")
    title = yaml.safe_load(text).get("name") or path.stem
    shown = picture(ROOT / "results" / path.relative_to(CONFIGS).with_suffix(""))
    place = path.relative_to(ROOT).as_posix()
    parts = [f"# {title}", comment(text)]
    if shown is not None:
        parts.append(f"![{title}](../../{shown.relative_to(ROOT).as_posix()})")
    begin = len(_opening(text)) + 1
    parts.append(f"```sh\nmechdesign run {place}\n```\n\n`{place}`:")
    parts.append(f"```{{literalinclude}} ../../{place}\n:language: yaml\n:lines: {begin}-\n```")
    return "\n\n".join(parts) + "\n"


def pages() -> dict[str, str]:
    """The texts of all pages and of their list, by their paths in the folder of the site."""
    found = studies()
    parts = ["# Gallery", "Every study here is in the repository, runs as it is, and is tested against its source."]
    for group, names in GROUPS.items():
        listed = "\n".join(names)
        parts.append(f"## {group}\n\n```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```")
    return {
        "gallery/index.md": "\n\n".join(parts) + "\n",
        **{f"gallery/{name}.md": page(path) for name, path in found.items()},
    }

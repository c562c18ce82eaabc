"""A page for every shipped study: what its opening comment says, its picture, the file itself, the command."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable
from functools import cache
from pathlib import Path

import yaml
from steps import step
from thumbnails import thumbnail

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
    "Straight lines": ("chebyshev", "hoeken", "hart", "peaucellier", "watt_parallel_motion", "pantograph",
                       "acrylic_leg"),
    "From a task": ("five_positions", "log10", "robust_curve"),
    "Gears, belts and cams": ("geared_five_bar", "planetary", "differential", "one_tooth_difference", "cycloidal_crank",
                              "rack_slider", "parallel_gripper", "cam_dwell", "cam_arm", "belt_scara"),
    "Robots": ("five_bar", "two_rpr", "two_rrr", "two_rpr_printed", "two_rrr_printed", "robot_arm", "scara",
               "rrr_platform", "rrr_orientations"),
    "Reliability": ("two_link_arm", "two_link_arm_uniform", "slider_crank_tolerances", "function_generator_made",
                    "bored_in_one_setting", "cheapest_tolerances", "one_in_a_billion", "five_bar_precision_map"),
    "Dynamics": ("flywheel_press", "twin_cylinder", "wiper_motor", "balanced_arm", "excavator_lift",
                 "pendulum", "braked_pendulum", "wedge_press"),
    "Stiffness": ("planar_3rpr", "planar_2rpr_rp", "planar_rp_rr", "press_stiffness", "stiffness_map", "loaded_arm"),
}  # fmt: skip
# Of the home page: mechanisms that look unlike each other.
HOME = ("four_bar", "jansen", "shaper", "five_bar", "scissor_lift", "v_twin", "peaucellier", "excavator", "watt",
        "pantograph", "klann", "trammel")  # fmt: skip
# The picture that says most, where there are several; paths of a group without one.
PICTURES = ("optimum", "solutions", "allocation", "free_bodies", "deflections", "failure_map", "density_contours",
            "springs", "workspace", "paths", "bands", "reliability", "mechanism")  # fmt: skip


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


def _block(match: re.Match[str]) -> str:
    lines = [line.strip() for line in match.group().splitlines()]
    kind = "sh" if lines[0].startswith("mechdesign ") else "text"
    return "\n".join((f"```{kind}", *lines, "```", ""))


def results(path: Path) -> Path:
    """The folder of the shipped results of a study."""
    return ROOT / "results" / path.relative_to(CONFIGS).with_suffix("")


def picture(folder: Path) -> Path | None:
    """The picture of a study's results that says most."""
    images = {path.stem: path for path in sorted(folder.rglob("*.png"))}
    return next((images[name] for name in PICTURES if name in images), None)


@cache
def title(path: Path) -> str:
    """What a study is called."""
    return str(yaml.safe_load(path.read_text(encoding="utf-8")).get("name") or path.stem)


def page(path: Path) -> str:
    """The page of one study."""
    text = path.read_text(encoding="utf-8")
    shown = picture(results(path))
    place = path.relative_to(ROOT).as_posix()
    parts = [f"# {title(path)}", comment(text)]
    if shown is not None:
        parts.append(f"![{title(path)}](../../{shown.relative_to(ROOT).as_posix()})")
    begin = len(_opening(text)) + 1
    parts.append(f"```sh\nmechdesign run {place}\n```\n\n`{place}`:")
    parts.append(f"```{{literalinclude}} ../../{place}\n:language: yaml\n:lines: {begin}-\n```")
    return "\n\n".join(parts) + "\n"


def wall(names: Iterable[str], moving: Container[str], folder: str = "") -> str:
    """Thumbnails of studies, each a link to its page: those that move, and pictures of the results of the others.

    `folder` is the way from the page with the wall to the gallery.
    """
    paths, lines = studies(), []
    for name in names:
        shown = picture(results(paths[name]))
        if name in moving:
            image = f"![]({folder}{name}.svg)"
        elif shown is not None:
            up = "../" if folder else "../../"
            image = f"![]({up}{shown.relative_to(ROOT).as_posix()})"
        else:
            image = ""
        lines.append(f"[{image} {title(paths[name])}]({folder}{name}.md)")
    return "\n\n".join((":::{container} wall", *lines, ":::"))


def pages(moving: Container[str] = ()) -> dict[str, str]:
    """The texts of all pages and of their list, by their paths in the site; thumbnails of `moving` studies move."""
    parts = ["# Gallery", "Every study here is in the repository, runs as it is, and is tested against its source."]
    for group, names in GROUPS.items():
        listed = "\n".join(names)
        parts.append(f"## {group}\n\n{wall(names, moving)}\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```")
    return {
        "gallery/index.md": "\n\n".join(parts) + "\n",
        **{f"gallery/{name}.md": page(path) for name, path in studies().items()},
    }


def with_thumbnails() -> dict[str, str]:
    """All pages, the thumbnails that move, and the wall of the home page, by their paths in the folder of the site."""
    moving: dict[str, str] = {}
    for name, path in studies().items():
        with step(f"thumbnail of {name}"):
            svg = thumbnail(path)
        if svg is not None:
            moving[name] = svg
    thumbnails = {f"gallery/{name}.svg": svg for name, svg in moving.items()}
    return pages(moving) | thumbnails | {"gallery/_home.md": wall(HOME, moving, "gallery/") + "\n"}

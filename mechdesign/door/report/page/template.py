"""Pages from templates: styles and scripts inside, and a policy that lets nothing else run or load."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from mechdesign.door.report.page.dark import dark
from mechdesign.door.report.page.headlines import shown
from mechdesign.door.report.page.pages import harmless
from mechdesign.ground.errors import counted
from mechdesign.ground.numerals import printed

_OWN = "mechdesign.door.report.page"
_INDENT = re.compile(r"^[ ]*(?://.*\n)?", re.MULTILINE)  # and a line of comment


def rendered(
    template: str, *, parts: Sequence[str] = (), drawings: Iterable[str] = (), package: str = _OWN,
    connect: str = "", **content: Any,
) -> bytes:  # fmt: skip
    """A page with the scripts and styles of some parts, and the colours of some drawings on a dark screen.

    Parameters
    ----------
    parts : sequence of str
        Names of scripts, and of styles where there are any of the name; those of every page come with them.
    package : str
        Where templates and parts are looked for before the folder of reports.
    connect : str
        What the scripts may ask, as a source of a content security policy; nothing by default.
    """
    folders = [files(name).joinpath("templates") for name in dict.fromkeys((package, _OWN))]

    def text(name: str) -> str:
        """A file without indents and lines of comments; empty where there is none."""
        file = next((file for folder in folders if (file := folder.joinpath(name)).is_file()), None)
        return "" if file is None else _INDENT.sub("", file.read_text(encoding="utf-8"))

    styles = "".join(text(f"{part}.css") for part in ("page", *parts)) + dark(drawings)
    script = "".join(text(f"{part}.js") for part in ("elements", *parts, "page"))
    policy = ["default-src 'none'", "img-src data:", f"style-src {_hash(styles)}", f"script-src {_hash(script)}"]
    policy += [f"connect-src {connect}"] if connect else []
    return (
        _environment(package)
        .get_template(template)
        .render(
            **content,
            policy="; ".join([*policy, "base-uri 'none'", "form-action 'none'"]),
            # These texts are files of the package, and none contains the end tag of its element.
            styles=Markup(styles),
            script=Markup(script),
        )
        .encode()
    )


def fragment(template: str, package: str, **content: Any) -> str:
    """A part of a page from a template of a package."""
    return _environment(package).get_template(template).render(**content)


@cache
def _environment(package: str) -> Environment:
    made = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in dict.fromkeys((package, _OWN))]),
        autoescape=True, undefined=StrictUndefined, finalize=harmless, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    made.policies["json.dumps_kwargs"] = {"sort_keys": True, "separators": (",", ":")}
    made.filters |= {"printed": printed, "counted": counted, "shown": shown}
    return made


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

"""Fonts for names in letters that Matplotlib's own font does not have, and what to say where none is installed."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from matplotlib.font_manager import fontManager, get_font

OWN = "DejaVu Sans"
# With letters of China, Japan and Korea; those of Linux, Windows and macOS.
_EAST_ASIAN = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans CJK KR", "Noto Sans SC", "Noto Sans JP", "Noto Sans KR",
    "Source Han Sans SC", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei", "Droid Sans Fallback", "Microsoft YaHei",
    "SimHei", "Yu Gothic", "Meiryo", "MS Gothic", "Malgun Gothic", "NanumGothic", "PingFang SC", "Hiragino Sans",
    "Heiti TC", "Apple SD Gothic Neo", "Arial Unicode MS", "Unifont",
)  # fmt: skip
_MOST_LETTERS = 8  # in a message


@cache
def families() -> list[str]:
    """The font of all pictures, and those installed for letters that it does not have."""
    installed = {font.name for font in fontManager.ttflist}
    return [OWN, *(name for name in _EAST_ASIAN if name in installed)]


def lost_letters(words: str) -> str:
    """What to tell of letters that no font of pictures has; empty where there are none."""
    if words.isascii():
        return ""
    fonts = [get_font(fontManager.findfont(name)) for name in families()]
    lost = [letter for letter in dict.fromkeys(words)
            if letter.isprintable() and not any(font.get_char_index(ord(letter)) for font in fonts)]  # fmt: skip
    shown = "".join(lost[:_MOST_LETTERS]) + "\N{HORIZONTAL ELLIPSIS}" * (len(lost) > _MOST_LETTERS)
    cure = "none of their fonts has these letters; install one, such as Noto Sans CJK, or name parts in Latin letters"
    return f"pictures show boxes in place of {shown}: {cure}" if lost else ""


@contextmanager
def quiet() -> Iterator[None]:
    """Matplotlib does not warn of each letter without a font inside the context: `lost_letters` tells of all."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from")
        yield

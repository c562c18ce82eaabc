"""A motion as a moving picture."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.layout import draw
from mechdesign.drawing.marks import Picture
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.numerics.arrays import Ints, evenly
from mechdesign.questions.kinematics.figures.paths import path_marks
from mechdesign.questions.poses import Shown

FRAMES = 36  # at most
_COLORS = 32
_WHITE = 244  # brightness of 255 from which on a colour is white
_WIDTH = 480  # pixels
# Milliseconds.
_CYCLE = 3600  # of the whole
_MIN_FRAME = 50
_MAX_FRAME = 160
_SHORTEST, _LONGEST = 500, 12_000  # a motion over time that is seen in its own time


def animation(shown: Shown) -> bytes:
    """The valid poses of a sweep or path as an endless GIF; back again where it does not end where it began.

    A motion over time runs forward in its own time, where that is neither too short nor too long to be watched. At most
    `FRAMES` frames. Poses that are not valid have none; the title says how many. Lists and grids of poses are
    no motion, and give no bytes.

    Matplotlib draws what stands still once and what moves in every frame; Pillow gives all frames one small palette, so
    that a frame stores only what changed: a tenth of the time and the bytes of `matplotlib.animation.PillowWriter`.
    """
    sweep = Sweep.of(shown)
    if not sweep.poses.followed or not len(sweep.valid):
        return b""
    timed = sweep.poses.times is not None
    some, pause = _in_time(sweep) if timed else _in_steps(sweep)
    panel = drawn_plane([*path_marks(sweep), Posed(None)], sweep.extent, sweep.study, sweep.words(int(some[0])))
    figure = draw(Picture("", [panel]))
    figure.set_dpi(_WIDTH / style.width())
    pictures = _frames(figure, sweep, some)
    if not timed and not sweep.closed:
        pictures += pictures[-2:0:-1]
    palette = _palette(pictures)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    stream = io.BytesIO()
    frames[0].save(stream, format="GIF", save_all=True, append_images=frames[1:], duration=pause // 10 * 10, loop=0)
    return stream.getvalue()


def _in_steps(sweep: Sweep) -> tuple[Ints, int]:
    """Poses evenly spread, and how long each is seen (ms); a motion that does not return goes back through them."""
    valid, closed = in_order(sweep), sweep.closed
    # A closed motion begins again with its last pose; another shows its inner poses twice.
    some = valid[evenly(len(valid), FRAMES + 1 if closed else FRAMES // 2 + 1)]
    some = some[:-1] if closed and len(some) > 1 else some
    count = len(some) if closed else max(2 * len(some) - 2, 1)
    return some, min(max(_CYCLE // count, _MIN_FRAME), _MAX_FRAME)


def _in_time(sweep: Sweep) -> tuple[Ints, int]:
    """Poses at even times, and how long each is seen (ms)."""
    assert sweep.poses.times is not None
    times = sweep.poses.times[sweep.rows[sweep.valid]]
    own = 1000 * float(times[-1] - times[0]) * sweep.study.units.time_factor
    whole = own if _SHORTEST <= own <= _LONGEST else _CYCLE
    count = int(min(max(whole // _MIN_FRAME, 1), FRAMES, len(times)))
    frames = times[0] + (times[-1] - times[0]) * np.arange(count) / count
    return sweep.valid[np.abs(times - frames[:, None]).argmin(axis=1)], int(whole / count)


def in_order(sweep: Sweep) -> Ints:
    """Valid poses; a turn that does not close everywhere begins behind the gap, so that its motion is in one piece."""
    valid = sweep.valid
    gaps = np.flatnonzero(np.diff(valid) > 1)
    if sweep.returns and len(gaps):
        valid = np.roll(valid[1:], -gaps[0])
    return valid


def _frames(figure: Figure, sweep: Sweep, indices: Ints) -> list[Image.Image]:
    canvas: Any = figure.canvas  # the Agg canvas; its own methods have no types
    (axes,) = figure.axes
    title = axes.set_title(axes.get_title(loc="left"), loc="left", fontsize=10.5)
    # The paths stand still, but above plates that move.
    lasting = [*axes.get_lines(), title]
    for artist in lasting:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    failed = len(sweep.rows) - len(sweep.valid)
    note = f"   ({failed} of {len(sweep.rows)} poses not valid)" if failed else ""
    standing = set(axes.get_children())
    pictures = []
    for index in indices.tolist():
        Posed(sweep.at(index), names=False, drives=False).draw(axes)
        title.set_text(sweep.words(index) + note)
        moving = [artist for artist in axes.get_children() if artist not in standing]
        canvas.restore_region(still)
        for artist in sorted([*lasting, *moving], key=lambda artist: artist.get_zorder()):
            axes.draw_artist(artist)
        for artist in moving:
            artist.remove()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    return pictures


def _palette(pictures: list[Image.Image]) -> Image.Image:
    """Colours that do for all frames, from some of them."""
    some = pictures[:: max(1, len(pictures) // 4)]
    width, height = some[0].size
    sheet = Image.new("RGB", (width, height * len(some)))
    for k, picture in enumerate(some):
        sheet.paste(picture, (0, k * height))
    quantized = sheet.quantize(colors=_COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    colors = np.array(quantized.getpalette()).reshape(-1, 3)
    # Means of the lightest colours are not quite the white of the page.
    colors[colors.min(axis=1) >= _WHITE] = 255
    palette = Image.new("P", (1, 1))
    palette.putpalette(colors.ravel().tolist())
    return palette

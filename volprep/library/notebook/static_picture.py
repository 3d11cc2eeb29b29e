"""A still picture of a package for where nothing runs: GitHub, nbconvert."""

import io
import textwrap
from pathlib import Path

import matplotlib
from PIL import Image, ImageDraw, ImageFont

_LETTERS = 38
_LINE = 15
_MARGIN = 6


def captioned(picture: bytes, words: str) -> bytes:
    """Return the PNG file of `picture` with `words` in lines below it: viewers show one form of an output, not two."""
    shown = Image.open(io.BytesIO(picture)).convert("RGB")
    lines = textwrap.wrap(words, _LETTERS)
    sheet = Image.new("RGB", (shown.width, shown.height + len(lines) * _LINE + 2 * _MARGIN), "white")
    sheet.paste(shown)
    draw = ImageDraw.Draw(sheet)
    # Pillow's own font lacks ×.
    font = ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf", 11)
    for number, line in enumerate(lines):
        draw.text((_MARGIN, shown.height + _MARGIN + number * _LINE), line, fill="black", font=font)
    file = io.BytesIO()
    sheet.save(file, "PNG")
    return file.getvalue()

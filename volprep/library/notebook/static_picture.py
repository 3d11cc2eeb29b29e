"""A still picture of a package for where nothing runs: GitHub, nbconvert."""

import io
import struct
import textwrap
from pathlib import Path

import matplotlib
from PIL import Image, ImageDraw, ImageFont

_LETTERS = 38
_LINE = 15
_MARGIN = 6
_MOST_PIXELS = 2**24
"""Most pixels of a preview that is shown. It may be of a package of anyone: 0.5 MB unpack to 500."""


def captioned(picture: bytes, words: str) -> bytes | None:
    """Return the PNG file of `picture` with `words` in lines below it: viewers show one form of an output, not two.

    None for a picture that is no PNG, damaged or too large.
    """
    if picture[:8] != b"\x89PNG\r\n\x1a\n" or len(picture) < 24:
        return None
    width, height = struct.unpack(">II", picture[16:24])
    if width * height > _MOST_PIXELS:
        return None
    try:
        shown = Image.open(io.BytesIO(picture), formats=["PNG"]).convert("RGB")
    except (OSError, SyntaxError, ValueError):  # as Pillow raises them for damaged files
        return None
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

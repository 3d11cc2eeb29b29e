"""A sheet of pictures with names below, over white."""

from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw

_SIDE = 192
_TEXT = 26
_COLUMNS = 8


def write_sheet(target: Path, pictures: Sequence[tuple[str, Path]], columns: int = _COLUMNS) -> None:
    """Write the pictures to `target`, a PNG file, row by row."""
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * (_SIDE + 4), max(rows, 1) * (_SIDE + _TEXT)), "white")
    draw = ImageDraw.Draw(sheet)
    for number, (name, path) in enumerate(pictures):
        row, column = divmod(number, columns)
        x, y = column * (_SIDE + 4), row * (_SIDE + _TEXT)
        with Image.open(path) as opened:
            picture = opened.convert("RGBA")
        picture.thumbnail((_SIDE, _SIDE))
        sheet.paste(picture, (x, y), picture)
        draw.rectangle((x, y, x + _SIDE, y + _SIDE), outline="#dddddd")
        draw.text((x + 2, y + _SIDE + 1), name[:31], fill="black")
        draw.text((x + 2, y + _SIDE + 12), name[31:62], fill="black")
    sheet.save(target)

"""Channels in the texels of one texture against textures apart: drawn together, and one of them alone.

The shaders take the same samples, classify them alike, and give the same picture; only the fetches differ. Both are
drawn in turn, so that what else the machine does falls on both.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

SHAPE_ZYX = (96, 112, 128)
PICTURE_HW = (160, 160)
ROUNDS = 7
VIEW = "anterior-left"
PROFILES = ("gles3", "gles2-2048")


@dataclass(frozen=True)
class ChannelRow:
    """A picture of a volume of several channels."""

    profile: str
    """Class of devices."""
    channels: int
    """Channels of the volume."""
    picture: str
    """What is drawn."""
    packed_ms: float
    """Best time where the channels share texels."""
    apart_ms: float | None
    """Best time where each has a texture of its own; None where these cannot be drawn together."""


def measure_channels(console: Console) -> Iterator[ChannelRow]:
    """Draw two and four channels, on every class of devices."""
    with tempfile.TemporaryDirectory() as folder:
        for profile in PROFILES:
            for channels in (2, 4):
                console.print(f"measuring {channels} channels, {profile}", style="dim")
                yield from _measured(Path(folder), profile, channels)


def channels_table(rows: list[ChannelRow]) -> Table:
    """Give the table of the rows."""
    table = Table("profile", "channels", "drawn", "packed ms", "apart ms", "apart / packed")
    for column in table.columns[3:]:
        column.justify = "right"
    for row in rows:
        times = ("", "") if row.apart_ms is None else (f"{row.apart_ms:.1f}", f"{row.apart_ms / row.packed_ms:.2f} ×")
        table.add_row(row.profile, str(row.channels), row.picture, f"{row.packed_ms:.1f}", *times)
    return table


def _measured(folder: Path, profile: str, channels: int) -> list[ChannelRow]:
    packed = _package(folder, profile, channels, "packed", together=True)
    # Mosaics apart cannot be drawn together.
    apart = _package(folder, profile, channels, "apart", together=profile == "gles3")
    rows = []
    for transfer, picture in (("together", "all together"), ("transfer-0", "one alone")):
        drawn = [
            each for each in (packed, apart) if transfer != "together" or each.manifest.picture(transfer) is not None
        ]
        best = _best_ms(drawn, transfer)
        rows.append(ChannelRow(profile, channels, picture, best[0], best[1] if len(best) > 1 else None))
    return rows


def _best_ms(packages: list[Package], transfer: str) -> list[float]:
    best = [float("inf")] * len(packages)
    for _ in range(ROUNDS):
        for index, package in enumerate(packages):
            with Renderer(package, transfer=transfer) as renderer:
                grid = renderer.level.grid
                camera = standard_views(grid, "orthographic")[VIEW].box_from_clip(grid, 1.0)
                best[index] = min(best[index], renderer.time_ms(camera, PICTURE_HW, repeats=1))
    return best


def _package(folder: Path, profile: str, channels: int, wish: str, *, together: bool) -> Package:
    """Build a volume of noisy balls beside each other."""
    name = f"{profile}-{channels}-{wish}"
    rng = np.random.default_rng(3)
    text = f'name = "{name}"\nprofile = "{profile}"\n'
    functions = ""
    for channel in range(channels):
        z, y, x = (np.linspace(-1, 1, n) - (0.2 * channel - 0.3 if n == SHAPE_ZYX[2] else 0) for n in SHAPE_ZYX)
        ball = np.clip(1.2 - (z[:, None, None] ** 2 + y[:, None] ** 2 + x**2), 0, 1) * 200
        path = folder / f"{channels}-{channel}.raw"
        path.write_bytes((ball + rng.integers(0, 30, SHAPE_ZYX)).astype(np.uint8).tobytes())
        text += f'[[source.channels]]\nname = "channel-{channel}"\npath = "{path.name}"\n'
        text += f'raw = {{ shape_zyx = {list(SHAPE_ZYX)}, dtype = "uint8", spacing_mm_zyx = [1.0, 1.0, 1.0] }}\n'
        functions += f'[[transfer]]\nname = "transfer-{channel}"\nchannel = "channel-{channel}"\npoints = [\n'
        functions += '{ value = 40.0, colour = "#ff6030", extinction_per_mm = 0.0 },\n'
        functions += '{ value = 255.0, colour = "#ffffff", extinction_per_mm = 0.03 }]\n'
    # Without tables every sample is fetched, which is what is measured.
    text += f'{functions}[lab.textures]\nchannels = "{wish}"\n[skip]\nkind = "none"\n[pyramid]\nfilter = "box"\n'
    scene = folder / f"{name}.toml"
    scene.write_text(text + ("[together]\n" if together else ""))
    build(load_request(scene), folder / f"{name}.volpkg", Silent())
    return Package.open(folder / f"{name}.volpkg")

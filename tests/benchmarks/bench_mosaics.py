"""Mosaics: packing against numpy and scikit-image, and what each layout's fetch costs and how wrong it is.

Times of the fetch are those of the driver at hand; a software driver pays for arithmetic what a phone pays for
bandwidth, so that the number of fetches and the bytes stand beside them.
"""

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from skimage.util import montage

from tests.support.tiny_packages import ES2, ES3, function, tiny_package
from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, pack_mosaic
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.metrics import picture_error
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.package.reader import Package
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL

from .contest import Contest

PACKED_ZYX = (441, 512, 512)
DRAWN_ZYX = (84, 127, 128)
PICTURE_HW = (160, 160)
STEP_MM = 0.5
ROUNDS = 3
VIEW = "anterior-left"
GLOW = function((40.0, (1.0, 0.4, 0.2), 0.0), (140.0, (1.0, 0.8, 0.6), 0.02), (255.0, (1.0, 1.0, 1.0), 0.08))


@dataclass(frozen=True)
class FetchRow:
    """A way to hold a volume, drawn."""

    layout: str
    """How the slices lie."""
    textures: int
    """Number of textures."""
    fetches: float
    """Texture fetches of one sample, on average."""
    bytes: int
    """Memory of the volume on the device."""
    ms: float
    """Best time of a picture."""
    rmse: float
    """Error of the picture against the oracle on the same voxels."""
    maximum: float
    """Largest error of the picture."""


def contests() -> Iterator[Contest]:
    """Give the contests of packing: 21×21 tiles of one channel, and four channels."""
    volume = np.random.default_rng(1).integers(0, 256, PACKED_ZYX, dtype=np.uint8)
    depth, height, width = PACKED_ZYX
    side = 21

    def transposed_copy() -> object:
        tiles = volume.reshape(side, side, height, width).transpose(0, 2, 1, 3)
        return np.ascontiguousarray(tiles).reshape(side * height, side * width)

    yield _packing(
        "mosaic, one channel",
        volume,
        Packing(),
        {"numpy transposed copy": transposed_copy, "skimage montage": lambda: montage(volume, grid_shape=(side, side))},
    )
    four = volume[: depth - depth % 4]
    rows, columns = 10, 11

    def transposed_four() -> object:
        tiles = four.reshape(rows, columns, 4, height, width).transpose(0, 3, 1, 4, 2)
        return np.ascontiguousarray(tiles)

    yield _packing("mosaic, interleaved", four, Packing(4), {"numpy transposed copy": transposed_four})
    yield _packing("mosaic, planar", four, Packing(4, "planar"), {"numpy transposed copy": transposed_four})


def _packing(work: str, volume: np.ndarray, packing: Packing, peers: dict) -> Contest:
    layout = fit_mosaic(volume.shape, packing, Room(21 * 512))
    assert layout is not None

    def ours() -> None:
        for _ in pack_mosaic(lambda z0, z1: volume[z0:z1], layout):
            pass

    return Contest(work=work, source=volume, bytes_written=volume.nbytes, ours=ours, peers=peers)


def measure_fetch(console: Console) -> Iterator[FetchRow]:
    """Draw one volume from every layout, in turn, and from a 3D texture."""
    volume = _phantom()
    profiles = {1: ES2, 2: ES2.model_copy(update={"max_texture_size": 512})}
    profiles[7] = ES2.model_copy(update={"max_texture_size": 260})
    cases: list[tuple[str, float, Packing, int]] = [("one channel", 2, Packing(), 1)]
    for textures in (1, 2, 7):
        cases.append(("interleaved", 1.25, Packing(4), textures))
        cases.append(("overlapping", 1, Packing(4, "overlapping"), textures))
        cases.append(("planar", 2, Packing(4, "planar"), textures))
    cases.append(("one channel, gutter 1", 2, Packing(gutter=1), 1))
    for order, fetches in (("interleaved", 1.25), ("overlapping", 1), ("planar", 2)):
        cases.append((f"{order}, gutter 1", fetches, Packing(4, order, 1), 1))
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        drawn = [("3D texture", 1.0, tiny_package(folder / "3d", volume, GLOW, ES3, step_mm=STEP_MM))]
        for k, (layout, fetches, packing, textures) in enumerate(cases):
            package = tiny_package(folder / str(k), volume, GLOW, profiles[textures], packing=packing, step_mm=STEP_MM)
            drawn.append((layout, fetches, package))
        renderers = [stack.enter_context(Renderer(package, target="rgba8")) for _, _, package in drawn]
        grid = drawn[0][2].manifest.levels[0].grid
        camera = standard_views(grid, "orthographic")[VIEW].box_from_clip(grid, aspect=1.0)
        truth = oracle_picture(Volume(volume, grid), GLOW, camera, PICTURE_HW).rgba
        best = [float("inf")] * len(drawn)
        for turn in range(ROUNDS):
            console.print(f"measuring the fetch of mosaics, round {turn + 1} of {ROUNDS}", style="dim")
            for k, renderer in enumerate(renderers):
                best[k] = min(best[k], renderer.time_ms(camera, PICTURE_HW, repeats=3))
        for (layout, fetches, package), renderer, ms in zip(drawn, renderers, best, strict=True):
            error = picture_error(renderer.render(camera, PICTURE_HW), truth)
            textures, size = _size(package)
            yield FetchRow(layout, textures, fetches, size, ms, error.rmse, error.maximum)


def fetch_table(rows: list[FetchRow]) -> Table:
    """Give the table of what `measure_fetch` found."""
    table = Table("volume as", "textures", "fetches", "kB", "ms a picture", "RMSE", "largest error")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        numbers = (f"{row.fetches:g}", f"{row.bytes / 1000:.0f}", f"{row.ms:.1f}")
        table.add_row(row.layout, str(row.textures), *numbers, f"{row.rmse:.5f}", f"{row.maximum:.4f}")
    return table


def _phantom() -> np.ndarray:
    """Make a noisy ball in an empty surrounding."""
    z, y, x = (np.linspace(-1, 1, n) ** 2 for n in DRAWN_ZYX)
    ball = np.clip(1.2 - (z[:, None, None] + y[:, None] + x), 0, 1) * 200
    return (ball + np.random.default_rng(2).integers(0, 30, DRAWN_ZYX)).astype(np.uint8)


def _size(package: Package) -> tuple[int, int]:
    """Number and bytes of the volume's textures."""
    manifest = package.manifest
    volumes = [texture for texture in manifest.textures if texture.role == "volume"]
    formats = [texture.format for texture in volumes]
    sizes = [
        int(np.prod(texture.shape_zyx)) * BYTES_PER_TEXEL[name]
        for texture, name in zip(volumes, formats, strict=True)
        if name is not None
    ]
    return len(volumes), sum(sizes)

"""Compressed mosaics of real scans: error against size and run time, and what blocks that mix tiles would cost.

Each form is a whole package of the same part of a scan, so that bytes are those of its files, and pictures and times
those of the renderer; the driver decodes the blocks. Times are of the driver at hand: llvmpipe decodes EAC and ETC2 in
the fetch and ASTC on upload, phones all of them in the texture unit.
"""

import gzip
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from volprep.parts.compression.decision import FORMATS
from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, pack_mosaic
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat
from volprep_formats.textures.blocks import decode_blocks, encode_blocks
from volprep_formats.textures.mosaic import slices_of_mosaic

from .real_scans import scans_folder

PART_ZYX = (48, 95, 94)
"""Of each scan, from its middle: sizes that are whole blocks of none of the formats."""
PICTURE_HW = (192, 192)
VIEWS = ("anterior-left", "superior", "left")
SCENE = """
name = "part"
profile = "gles3-astc"
crop = "none"
[source]
path = "part.raw"
[source.raw]
shape_zyx = [{shape}]
dtype = "uint8"
[quantize]
bits = 8
window = [0.0, 255.0]
[skip]
kind = "none"
[pyramid]
coarsest_longest_axis = 128
[render]
picture_size = 32
[tolerance]
rmse = 1.0
maximum = 1.0
[textures]
compression = "{compression}"
[[transfer]]
name = "surface"
points = [
    {{ value = 60.0, colour = "#804020", extinction_per_mm = 0.0 }},
    {{ value = 120.0, colour = "#ffc080", extinction_per_mm = 0.1 }},
    {{ value = 220.0, colour = "#ffffff", extinction_per_mm = 0.5 }},
]
"""


@dataclass(frozen=True)
class CompressedRow:
    """One form of one scan."""

    scan: str
    """Which scan."""
    form: str
    """How its voxels are stored."""
    bytes: int
    """Size of the textures of level 0."""
    encode_s: float
    """Time of encoding and packing."""
    psnr_db: float
    """Of the voxels; infinite where nothing is lost."""
    mixed_psnr_db: float
    """The same where tiles abut, so that blocks mix two of them."""
    picture_rmse: float
    """Of pictures of three views against those of the 3D texture."""
    picture_maximum: float
    """Largest error of a channel of a pixel."""
    picture_ms: float
    """Median time of a picture."""


def measure_compressed(console: Console) -> Iterator[CompressedRow]:
    """Measure every form of parts of real scans."""
    for scan, part in _parts(scans_folder()):
        console.print(f"measuring compressed mosaics, {scan}", style="dim")
        with tempfile.TemporaryDirectory() as folder:
            yield from _rows(scan, part, Path(folder))


def compressed_table(rows: list[CompressedRow]) -> Table:
    """Show them."""
    table = Table("scan", "form", "kB", "encode s", "PSNR dB", "mixed dB", "picture RMSE", "largest", "ms")
    for column in table.columns[2:]:
        column.justify = "right"
    for row in rows:
        table.add_row(
            row.scan,
            row.form,
            f"{row.bytes / 1e3:.0f}",
            f"{row.encode_s:.2f}",
            f"{row.psnr_db:.1f}",
            f"{row.mixed_psnr_db:.1f}",
            f"{row.picture_rmse:.4f}",
            f"{row.picture_maximum:.3f}",
            f"{row.picture_ms:.0f}",
        )
    return table


def _parts(data: Path) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    shape = (128, 256, 256)
    packed = (data / "engine_pair" / "data" / "engine_256x256x128_uint8.raw.gz").read_bytes()
    yield "engine", _middle(np.frombuffer(gzip.decompress(packed), np.uint8).reshape(shape))
    for scan, path in (("ch2", "nifti_ch2/ch2.nii.gz"), ("MR", "mr_t1_studyforrest")):
        with open_source(SourceSpec(path=str(data / path)), Path(), Silent()) as source:
            voxels = source.read_slab(0, source.info.grid.shape_zyx[0])
            yield scan, _middle(np.clip(voxels, 0, 255).astype(np.uint8))


def _middle(voxels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    starts = ((n - part) // 2 for n, part in zip(voxels.shape, PART_ZYX, strict=True))
    return voxels[tuple(slice(start, start + part) for start, part in zip(starts, PART_ZYX, strict=True))]


def _rows(scan: str, part: NDArray[np.uint8], folder: Path) -> Iterator[CompressedRow]:
    part.tofile(folder / "part.raw")
    truth = None
    for compression in ("none", *FORMATS):
        scene = folder / f"{compression}.toml"
        scene.write_text(SCENE.format(shape=", ".join(map(str, part.shape)), compression=compression))
        target = folder / f"{compression}.volpkg"
        build(load_request(scene), target, Silent())
        package = Package.open(target)
        pictures, ms = _drawn(package)
        truth = pictures if truth is None else truth
        error = pictures - truth
        volumes = [each for each in package.manifest.textures if each.role == "volume" and each.level == 0]
        name = None if compression == "none" else FORMATS[compression]
        mixed, seconds = (np.inf, 0.0) if name is None else _mixed(part, name)
        scale = 1.0 if name is None else 255.0
        yield CompressedRow(
            scan=scan,
            form="R8, 3D texture" if name is None else name,
            bytes=sum(len(package.read_bytes(texture.file)) for texture in volumes),
            encode_s=seconds,
            psnr_db=_psnr(level_texels(package, 0) * scale, part),
            mixed_psnr_db=mixed,
            picture_rmse=float(np.sqrt(np.mean(error**2))),
            picture_maximum=float(np.abs(error).max()),
            picture_ms=ms,
        )


def _drawn(package: Package) -> tuple[NDArray[np.float32], float]:
    grid = package.manifest.grid
    assert grid is not None
    cameras = [standard_views(grid)[view].box_from_clip(grid, 1.0) for view in VIEWS]
    with Renderer(package, level=0) as renderer:
        pictures = [renderer.render(camera, PICTURE_HW) for camera in cameras]
        return np.stack(pictures), renderer.time_ms(cameras[0], PICTURE_HW)


def _mixed(part: NDArray[np.uint8], name: CompressedFormat) -> tuple[float, float]:
    """PSNR where tiles abut, and the time to encode."""
    block = BLOCKS[name]
    layout = fit_mosaic(part.shape, Packing(4 if block.components == 4 else 1, "interleaved"), Room(4096))
    assert layout is not None
    texels = np.concatenate(list(pack_mosaic(lambda z0, z1: part[z0:z1], layout)))
    picture = texels if block.components == 4 else texels[..., 0]
    start = time.perf_counter()
    blocks = encode_blocks(picture, name)
    seconds = time.perf_counter() - start
    decoded = decode_blocks(blocks, name, layout.texture_shape_yx, block.components)
    return _psnr(slices_of_mosaic([decoded], layout) * 255.0, part), seconds


def _psnr(found: NDArray[np.generic], truth: NDArray[np.uint8]) -> float:
    mean = float(np.mean((found.astype(np.float64) - truth) ** 2))
    return float("inf") if mean == 0.0 else 10 * np.log10(255**2 / mean)

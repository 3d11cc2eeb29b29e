"""An existing mosaic: one picture whose tiles are the slices, row by row from the top left.

Tiles may be of fractional size: tile k of n on a side of length s begins at k·s/n, rounded half up, which is where a
shader that divides the picture by n finds it, and has floor(s/n) pixels. Tiles beyond the slices are spare: they may
hold anything and are not looked at.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.isolation import workers
from volprep_formats.progress import Progress
from volprep_formats.readers.decoded_source import DecodedSource
from volprep_formats.readers.pictures.file import DecodeRequest, Page, decode_request, page_remarks, read_headers
from volprep_formats.source import GreyOf, SourceInfo, SourceSpec, TileLayout


class MosaicSource(DecodedSource):
    """A mosaic, decoded one row of tiles after the other in worker processes."""

    def __init__(
        self, info: SourceInfo, path: Path, page: Page, tiles_yx: tuple[int, int], *, grey: GreyOf | None
    ) -> None:
        super().__init__(info)
        self._path = path
        self._page = page
        self._tiles_yx = tiles_yx
        self._grey = grey

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x].

        Raises VolprepError VP1164 (colour), VP1165 (damaged) and VP1270 to VP1273 (its decoder goes wrong).
        """
        tiles_y, tiles_x = self._tiles_yx
        _, height, width = self._info.grid.shape_zyx
        slab = np.empty((z1 - z0, height, width), dtype=self._info.stored_type)
        bands = range(z0 // tiles_x, -(-z1 // tiles_x)) if z1 > z0 else range(0)

        def place(index: int, band: NDArray[np.generic]) -> None:
            first = bands[index] * tiles_x
            for z in range(max(first, z0), min(first + tiles_x, z1)):
                left = tile_start(z - first, tiles_x, self._page.columns)
                slab[z - z0] = band[0, :, left : left + width]

        parts = []
        for band in bands:
            top = tile_start(band, tiles_y, self._page.rows)
            tiles = min(self._info.grid.shape_zyx[0] - band * tiles_x, tiles_x)  # the others are spare
            columns = tile_start(tiles - 1, tiles_x, self._page.columns) + width
            parts.append(DecodeRequest(self._path, 0, 1, top, top + height, columns, self._page, self._grey))
        self._workers.run([decode_request(part) for part in parts], place)
        return slab


def tile_start(tile: int, tiles: int, length: int) -> int:
    """First pixel of a tile: tile · length / tiles, rounded half up."""
    return (2 * tile * length + tiles) // (2 * tiles)


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> MosaicSource:
    """Open the picture `path` with the tiles of `spec`.

    Raises VolprepError VP1165 to VP1167 (damaged, or cannot be read), VP1180 (no tile layout), VP1181 (they do not fit)
    or VP1270 to VP1273.
    """
    layout = spec.mosaic
    if layout is None:
        raise VolprepError("VP1180", path=path)
    with workers() as pool:
        progress.start("reading the header of the mosaic", 1)
        (pages,) = read_headers(pool, [path], progress)
        if (count := max(len(pages), pages[0].images)) > 1:
            raise VolprepError("VP1166", path=path, what=f"{count} pages as a mosaic")
        page = pages[0]
        info = _info(path, page, layout, grey=spec.rgb)
        return MosaicSource(info, path, page, (layout.tiles_y, layout.tiles_x), grey=spec.rgb)


def _info(path: Path, page: Page, layout: TileLayout, *, grey: GreyOf | None) -> SourceInfo:
    height, width = page.rows // layout.tiles_y, page.columns // layout.tiles_x
    if layout.slices > layout.tiles_x * layout.tiles_y or not height or not width:
        raise VolprepError(
            "VP1181",
            path=path,
            columns=page.columns,
            rows=page.rows,
            tiles_x=layout.tiles_x,
            tiles_y=layout.tiles_y,
            slices=layout.slices,
        )
    remarks = page_remarks(page, path.name, grey=grey)
    if page.rows % layout.tiles_y or page.columns % layout.tiles_x:
        size = f"{page.columns / layout.tiles_x:.6g}×{page.rows / layout.tiles_y:.6g}"
        remarks.append(f"tiles of {size} pixels are cut to {width}×{height}, each from its rounded beginning")
    return SourceInfo(
        format="mosaic",
        grid=Grid.of((layout.slices, height, width), layout.spacing_mm_zyx),
        stored_type=page.stored_type,
        remarks=tuple(remarks),
    )

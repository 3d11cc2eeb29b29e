"""Bricks for devices without 3D textures: the pool as one mosaic, and the index as another.

The slices of the pool are the slices of the mosaic, so that the mosaic's own arithmetic reads a brick. Nothing lies
between bricks: a position stays inside its brick, and with it the filter.
"""

from volprep.parts.bricks.pool import MOST_PLACES, cells_of
from volprep.parts.mosaic.packing import Packing, fit_mosaic, room_of
from volprep.scan.block_ranges import Triple
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import MosaicLayout


def flat_pool(  # noqa: PLR0917 - the level, its bricks, and the device class
    shape_zyx: Triple, size: int, reach: int, packing: Packing, profile: DeviceProfile, stored: int | None = None
) -> tuple[BrickLayout, MosaicLayout] | None:
    """Lay out so many bricks, all if None, in the smallest texture of a device class; None where it has no room."""
    cells, counts = cells_of(shape_zyx, size)
    count = counts[0] * counts[1] * counts[2] if stored is None else stored
    room = room_of(profile)
    # More rows make larger tiles, which fill a texture worse: the fewest are best.
    for rows in range(1, min(count, MOST_PLACES) + 1):
        found = []
        for columns in range(1, min(-(-count // rows), MOST_PLACES) + 1):
            down = -(-count // (rows * columns))
            pool = BrickLayout(
                cells_zyx=cells, reach=reach, bricks_zyx=counts, pool_zyx=(down, rows, columns), stored=count
            )
            if max(pool.pool_texels_zyx[1:]) > room.size:
                break
            mosaic = fit_mosaic(pool.pool_texels_zyx, packing, room) if down <= MOST_PLACES else None
            if mosaic is not None:
                height, width = mosaic.texture_shape_yx
                found.append(((height * width, max(height, width), columns), pool, mosaic))
        if found:
            _, pool, mosaic = min(found, key=lambda value: value[0])
            return pool, mosaic
    return None


def held_zyx(layout: BrickLayout, mosaic: MosaicLayout | None) -> Triple:
    """Return the texels of the texture that holds a pool."""
    return layout.pool_texels_zyx if mosaic is None else (1, *mosaic.texture_shape_yx)


def index_zyx(shape_zyx: Triple, size: int, profile: DeviceProfile) -> Triple:
    """Return the texels of the texture with an entry for each brick of a level."""
    _, counts = cells_of(shape_zyx, size)
    mosaic = None if profile.max_3d_texture_size else flat_index(counts, profile)
    return counts if mosaic is None else (1, *mosaic.texture_shape_yx)


def flat_index(bricks_zyx: Triple, profile: DeviceProfile) -> MosaicLayout | None:
    """Lay the entries of bricks out in one texture of a device class; None where it has no room."""
    return fit_mosaic(bricks_zyx, Packing(components_per_voxel=4), room_of(profile))

"""A level as bricks with ghost voxels: the visible bricks, side by side in one texture, and the position of each."""

from volprep_formats.grid import Count, Index
from volprep_formats.record import Record

Triple = tuple[int, int, int]


class BrickLayout(Record):
    """Layout of the bricks of a level, and their number in the texture."""

    cells_zyx: tuple[Index, Index, Index]
    """Cells between voxel centres along the edges of a brick; 0 along an axis of one voxel. The last brick of an axis
    may have fewer; its last voxels are then repeated."""
    reach: Count
    """Voxels on each side of a position that filters may read: 1 for linear ones. A brick holds the voxels at the ends
    of its cells and reach - 1 ghost voxels more on each side; beyond the volume the outer voxels are repeated."""
    bricks_zyx: tuple[Count, Count, Count]
    """Number of bricks of the level along each axis."""
    pool_zyx: tuple[Count, Count, Count]
    """Room for bricks along each axis of the pool."""
    stored: Count
    """Number of bricks that the texture holds. They fill its places in the order of the level's bricks: x first, then
    y, then z."""

    @property
    def pitch_zyx(self) -> Triple:
        """Texels of a brick along each axis."""
        z, y, x = (cells + 2 * self.reach - 1 for cells in self.cells_zyx)
        return z, y, x

    @property
    def pool_texels_zyx(self) -> Triple:
        """Depth, height and width of the pool in texels: of a 3D texture, or of the slices of a mosaic."""
        z, y, x = (n * pitch for n, pitch in zip(self.pool_zyx, self.pitch_zyx, strict=True))
        return z, y, x

"""OpenVDB, as far as volume formats use it."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


def library_version() -> str:
    """Version of the OpenVDB that volprep was built with."""

class GridInfo:
    """Header of a grid, read before its tree."""

    @property
    def name(self) -> str:
        """Name, made unique with [0], [1], ..."""

    @property
    def value_type(self) -> str:
        """float, double, vec3s, ..."""

    @property
    def grid_class(self) -> str:
        """Fog Volume, Level Set, Staggered Vector Field or Other."""

    @property
    def saved_as_half(self) -> bool:
        """Whether its floats have 16 bits in the file."""

    @property
    def declared_box_xyz(self) -> tuple[list[int], list[int]] | None:
        """
        First and last active voxel, as the file notes them; they may be wrong.
        """

def list_grids(path: str) -> list[GridInfo]:
    """
    All grids of a file, in its order. Raises RuntimeError for a damaged file.
    """

class ScalarGrid:
    """
    One grid of floats, doubles or vectors of three floats, whole in memory.
    """

    def __init__(self, path: str, index: int) -> None:
        """
        The grid number `index` of list_grids. Raises RuntimeError for a damaged grid.
        """

    @property
    def active_box_xyz(self) -> tuple[list[int], list[int]] | None:
        """
        First and last active voxel along x, y and z; None if no voxel is active.
        """

    @property
    def active_voxels(self) -> int:
        """Number of active voxels."""

    @property
    def background(self) -> float:
        """Value of all that no node covers."""

    @property
    def inexact_values(self) -> int:
        """
        Number of values, active or not, that 32-bit floating point does not hold exactly.
        """

    @property
    def world_from_index(self) -> list[list[float]] | None:
        """
        Rows of the 4×4 matrix from (x, y, z, 1) in voxels to world; None if it is not linear.
        """

    def copy(self, first_xyz: Sequence[int], dst: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu')]) -> None:
        """Fill `dst` [z, y, x] with the values from voxel `first_xyz` on."""

    def copy_vectors(self, first_xyz: Sequence[int], dst: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None, 3), order='C', device='cpu')]) -> None:
        """Fill `dst` [z, y, x, 3] with the vectors from voxel `first_xyz` on."""

class FogVolume:
    """A sparse grid of floats with background 0, made slab by slab."""

    def __init__(self, name: str, world_from_index: Sequence[Sequence[float]]) -> None:
        """The matrix has rows and maps (x, y, z, 1) in voxels to world."""

    def add(self, z0: int, src: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu', writable=False)]) -> None:
        """
        Take the values `src` [z, y, x] from slice `z0` on. Zeros stay inactive.
        """

    def activate(self, xyz: Sequence[int]) -> None:
        """Make a voxel active, whatever its value."""

    def write(self, path: str) -> None:
        """
        Write the file; bytes 21 to 56 are an identifier that is never the same. Raises RuntimeError.
        """

"""Replace excluded voxels by one value: voxels outside the mask, and NaN or infinite ones.

They are replaced before anything is made from the scan, so that no level, normal, table, mesh or picture depends on
their old values.
"""

from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import slab_ranges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec, VolumeSource, read_labels


def finite_range(source: VolumeSource, progress: Progress) -> tuple[float, float] | None:
    """Return the least and the greatest finite stored value, None for a scan without one; one reading of the scan."""
    info = source.info
    depth = info.grid.shape_zyx[0]
    progress.start("finding the range of values", depth)
    least, greatest = np.inf, -np.inf
    slice_bytes = prod(info.grid.shape_zyx[1:]) * np.dtype(info.stored_type).itemsize
    for z0, z1 in slab_ranges(depth, slice_bytes):
        slab = source.read_slab(z0, z1)
        finite = slab[np.isfinite(slab)]
        if finite.size:
            least, greatest = min(least, float(finite.min())), max(greatest, float(finite.max()))
        progress.advance(z1 - z0)
    return (least, greatest) if np.isfinite(least) else None


class MeantSource(OpenedSource):
    """A source in which voxels outside the mask, and NaN or infinite ones, have the values that the scene names."""

    def __init__(self, spec: SourceSpec, source: VolumeSource, mask: VolumeSource | None, progress: Progress) -> None:
        """Take a source and, if there is one, its mask on the same voxels; find the least value if that is wanted.

        Raises VP1286 for a value that the type of the voxels cannot hold, and the errors of the readers.
        """
        self._spec = spec
        self._source = source
        self._mask = mask
        info = source.info
        remarks = list(info.remarks)
        outside: float | None = None
        if mask is not None or spec.nan == "outside":
            outside = self._least(progress) if spec.outside is None else self._stored(spec, spec.outside)
        self._outside = outside
        is_float = np.dtype(info.stored_type).kind == "f"
        self._nan = None if not is_float or spec.nan is None else outside
        if is_float and isinstance(spec.nan, float):
            self._nan = self._stored(spec, spec.nan)
        if mask is not None and outside is not None:
            remarks.append(f"what the mask leaves out has the value {info.slope * outside + info.intercept:.6g}")
        if self._nan is not None:
            remarks.append(f"voxels that are NaN got the value {info.slope * self._nan + info.intercept:.6g}")
        resources = (source,) if mask is None else (source, mask)
        super().__init__(info.model_copy(update={"remarks": tuple(remarks)}), *resources)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x]. Raises VP2082 for a mask that is NaN somewhere."""
        return self._replaced(self._source.read_slab(z0, z1), z0, z1)

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x], in the type of the file, if the source has them."""
        return self._replaced(read_labels(self._source, z0, z1), z0, z1)

    def _replaced(self, slab: NDArray[np.generic], z0: int, z1: int) -> NDArray[np.generic]:
        if self._nan is not None:
            slab = np.where(np.isnan(slab), slab.dtype.type(self._nan), slab)
        if self._mask is not None:
            mask = self._mask.read_slab(z0, z1)
            unknown = np.isnan(mask).any(axis=(1, 2))
            if unknown.any():
                raise VolprepError("VP2082", path=self._spec.mask, z=z0 + int(unknown.argmax()))
            slab = np.where(mask != 0, slab, slab.dtype.type(self._outside))
        return slab

    def _least(self, progress: Progress) -> float:
        """Return the least finite stored value, which takes one reading of the scan."""
        return (finite_range(self._source, progress) or (0.0, 0.0))[0]

    def _stored(self, spec: SourceSpec, physical: float) -> float:
        """Return the stored value of a physical one. Raises VP1286 if the type of the voxels has none."""
        info = self._source.info
        stored = (physical - info.intercept) / info.slope
        dtype = np.dtype(info.stored_type)
        if dtype.kind == "f":
            return stored
        limits = np.iinfo(info.stored_type)
        whole = round(stored)
        if not limits.min <= whole <= limits.max or abs(whole - stored) > 1e-6 * max(1.0, abs(stored)):
            least, most = (info.slope * end + info.intercept for end in (limits.min, limits.max))
            raise VolprepError(
                "VP1286", path=Path(spec.path), value=physical, type=dtype.name, step=info.slope, low=least, high=most
            )
        return float(whole)

"""Facts from a scan's header, read before it is built: for rules and for estimates."""

from dataclasses import dataclass, field
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_slices
from volprep_formats.readers.dicom.listing import listed_series
from volprep_formats.readers.dicom.scan import Series
from volprep_formats.source import SourceSpec
from volprep_formats.uneven_source import UnevenSource


@dataclass(frozen=True)
class Facts:
    """Facts from a scan's header."""

    format: str
    """Name of the reader: dicom, nifti, ...; empty if no reader knows the scan."""
    modality: str = ""
    """DICOM modality; empty if the source has none."""
    shape_zyx: tuple[int, int, int] | None = None
    """Slices, rows and columns; None if the scan cannot be opened."""
    spacing_mm_zyx: tuple[float | None, float | None, float | None] = (None, None, None)
    """Distance between voxel centres; None if it is unknown or not uniform."""
    description: str = field(default="", repr=False)
    """Free text description of a DICOM series: compared with patterns, and only shown on the screen."""

    @property
    def voxels(self) -> int | None:
        """Number of voxels."""
        if self.shape_zyx is None:
            return None
        slices, rows, columns = self.shape_zyx
        return slices * rows * columns


def facts_of_series(series: Series) -> Facts:
    """Return the facts in the headers of a DICOM series, including its description."""
    listed = listed_series(series)
    return Facts("dicom", listed.modality, listed.shape_zyx, listed.spacing_mm_zyx, listed.description)


def facts_of_source(spec: SourceSpec, known_format: str = "") -> Facts:
    """Return the facts in the header of a source; only its format if it cannot be opened: its build reports why."""
    try:
        with open_slices(spec, Path(), Silent()) as source:
            info = source.nominal if isinstance(source, UnevenSource) else source.info
    except VolprepError:
        return Facts(known_format)
    return Facts(info.format, info.modality, info.grid.shape_zyx, info.grid.spacing_mm_zyx)

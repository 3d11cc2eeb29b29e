"""What headers say of a scan before anything of it is built: for rules, and for estimates."""

from dataclasses import dataclass, field
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_slices
from volprep_formats.readers.dicom.listing import listed_series
from volprep_formats.readers.dicom.scan import Series
from volprep_formats.source import SourceSpec, UnevenSource


@dataclass(frozen=True)
class Facts:
    """What headers say of a scan."""

    format: str
    """Name of the reader: dicom, nifti, ...; empty where no reader knows the scan."""
    modality: str = ""
    """DICOM modality; empty where the source does not say."""
    shape_zyx: tuple[int, int, int] | None = None
    """Slices, rows and columns; None where the scan cannot be opened."""
    spacing_mm_zyx: tuple[float | None, float | None, float | None] = (None, None, None)
    """Distance between voxel centres; None where it is not known or not the same everywhere."""
    description: str = field(default="", repr=False)
    """What people called a DICOM series: compared with patterns, and shown on the screen alone."""

    @property
    def voxels(self) -> int | None:
        """Number of voxels."""
        if self.shape_zyx is None:
            return None
        slices, rows, columns = self.shape_zyx
        return slices * rows * columns


def facts_of_series(series: Series) -> Facts:
    """Return what the headers of a DICOM series say, its description included."""
    listed = listed_series(series)
    return Facts("dicom", listed.modality, listed.shape_zyx, listed.spacing_mm_zyx, listed.description)


def facts_of_source(spec: SourceSpec, known_format: str = "") -> Facts:
    """Return what the header of a source says. What cannot be opened has its format alone: its build will say why."""
    try:
        with open_slices(spec, Path(), Silent()) as source:
            info = source.nominal if isinstance(source, UnevenSource) else source.info
    except VolprepError:
        return Facts(known_format)
    return Facts(info.format, info.modality, info.grid.shape_zyx, info.grid.spacing_mm_zyx)

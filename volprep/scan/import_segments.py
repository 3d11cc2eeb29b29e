"""Segments become a label for each voxel of the scan, and a record of what the labels mean: working data of a draft."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from volprep.scan.segments.fitted import Fitted, fitted_segments
from volprep.scan.segments.record import FoundSegments, found_segments
from volprep.scan.slabs import bytes_of
from volprep_formats.grid import Grid
from volprep_formats.label_tables import companion_table
from volprep_formats.label_tables.hints import label_hint
from volprep_formats.label_tables.table import LABEL_TABLES
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import FOUND_SEGMENTS, SEGMENT_LABELS
from volprep_formats.path_text import path_of_text, path_text
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec


@dataclass(frozen=True)
class SegmentSource:
    """Where the segments of a scan are."""

    path: Path
    """File or folder, absolute."""
    table: str | None
    """Names and colours of label numbers: a built-in table, or an absolute path; found by itself if None."""
    scan: SourceSpec
    """The scan that they belong to."""

    @property
    def known_table(self) -> str | None:
        """The table that is asked for, FreeSurfer's for a file with one of its names, or one beside the file."""
        if self.table is not None or self.path.is_dir():
            return self.table
        if "FreeSurfer" in label_hint(self.path):
            return "freesurfer"
        beside = companion_table(self.path)
        return None if beside is None else path_text(beside)

    @property
    def files(self) -> tuple[Path, ...]:
        """All that is read beside the scan."""
        table = self.known_table
        return (self.path,) if table is None or table in LABEL_TABLES else (self.path, path_of_text(table))


def find_segments(source: SegmentSource, grid: Grid, progress: Progress) -> FoundSegments:
    """Return what an import would find. Raises what `fitted_segments` raises, VP1300 for a table that is not one."""
    fitted = _fitted(source, grid, progress)
    return found_segments(fitted, hashlib.sha256(bytes_of(fitted.labels)).hexdigest(), source.known_table)


def import_segments(draft: Draft, source: SegmentSource, grid: Grid, progress: Progress) -> None:
    """Write labels and descriptions of the segments of a scan to a draft. Raises what `find_segments` raises."""
    fitted = _fitted(source, grid, progress)
    written = draft.write(SEGMENT_LABELS, "work", bytes(bytes_of(fitted.labels)))
    found = found_segments(fitted, written.sha256, source.known_table)
    draft.write(FOUND_SEGMENTS, "work", found.model_dump_json().encode())


def _fitted(source: SegmentSource, grid: Grid, progress: Progress) -> Fitted:
    from volprep_formats.readers.dicom.frame import frame_of_reference  # noqa: PLC0415 - only scans with segments

    return fitted_segments(source.path, grid, frame_of_reference(source.scan, progress), progress)

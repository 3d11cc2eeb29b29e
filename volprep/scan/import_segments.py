"""Segments become a label for each voxel of the scan, and a record of what the labels mean: working data of a draft."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from volprep.scan.segments.fitted import Fitted, fitted_segments
from volprep.scan.segments.record import FoundSegments, found_segments
from volprep.scan.segments.smoothing import smoothed_labels, widest_smoothing_mm
from volprep.scan.slabs import bytes_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.label_tables import companion_table
from volprep_formats.label_tables.hints import label_hint
from volprep_formats.label_tables.table import LABEL_TABLES
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import FOUND_SEGMENTS, SEGMENT_LABELS
from volprep_formats.path_text import path_of_text, path_text
from volprep_formats.progress import Progress
from volprep_formats.segmentations.records import LabelArray
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
    smoothing_mm: float = 0.0
    """Standard deviation of the Gaussian that smooths their borders; 0 leaves them."""

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
        files = (self.path,) if table is None or table in LABEL_TABLES else (self.path, path_of_text(table))
        return tuple(dict.fromkeys(files))


def find_segments(source: SegmentSource, grid: Grid, progress: Progress) -> tuple[FoundSegments, LabelArray]:
    """Return what an import would find, and the labels [z, y, x].

    Raises what `fitted_segments` raises, VP1300 for a table that is not one, VP3225 for too wide a smoothing.
    """
    fitted = _fitted(source, grid, progress)
    sha256 = hashlib.sha256(bytes_of(fitted.labels)).hexdigest()
    return found_segments(fitted, sha256, source.known_table), fitted.labels


def import_segments(draft: Draft, source: SegmentSource, grid: Grid, progress: Progress) -> FoundSegments:
    """Write labels and descriptions of the segments of a scan to a draft, and return these.

    Raises what `find_segments` raises.
    """
    fitted = _fitted(source, grid, progress)
    written = draft.write(SEGMENT_LABELS, "work", bytes(bytes_of(fitted.labels)))
    found = found_segments(fitted, written.sha256, source.known_table)
    draft.write(FOUND_SEGMENTS, "work", found.model_dump_json().encode())
    return found


def _fitted(source: SegmentSource, grid: Grid, progress: Progress) -> Fitted:
    from volprep_formats.readers.dicom.frame import frame_of_scan  # noqa: PLC0415 - only scans with segments

    fitted = fitted_segments(source.path, grid, frame_of_scan(source.scan, progress), progress)
    if not source.smoothing_mm:
        return fitted
    widest_mm = widest_smoothing_mm(grid.shape_zyx, grid.spacing_mm_zyx)
    if source.smoothing_mm > widest_mm:
        raise VolprepError("VP3225", path=source.path, width=source.smoothing_mm, widest=widest_mm)
    return _smoothed(fitted, grid, source.smoothing_mm)


def _smoothed(fitted: Fitted, grid: Grid, smoothing_mm: float) -> Fitted:
    labels = smoothed_labels(fitted.labels, grid.spacing_mm_zyx, smoothing_mm)
    changed = float(np.mean(labels != fitted.labels))
    remark = (
        f"borders are smoothed with a Gaussian of {smoothing_mm:g} mm: {changed:.2%} of the voxels have another label"
    )
    before, after = (
        np.bincount(labelling.ravel(), minlength=len(fitted.members)) for labelling in (fitted.labels, labels)
    )
    gone = [label for label in np.flatnonzero((before > 0) & (after == 0)) if fitted.members[label]]
    numbers = {fitted.segments[fitted.members[label][0]].number for label in gone if len(fitted.members[label]) == 1}
    vanished = f"; segments {', '.join(map(str, sorted(numbers)))} are too thin and vanish" if numbers else ""
    return replace(fitted, labels=labels, remarks=(*fitted.remarks, remark + vanished))

"""A source becomes one volume with exact geometry and full precision, and is measured in the same pass.

Import comes before the plan, which needs its measurements, so it is not a `Stage`.
"""

import hashlib
import json
import math
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from volprep.scan.import_segments import SegmentSource
from volprep.scan.slabs import bytes_of
from volprep.scan.statistics import Measured, SlabMeasurer, source_slabs
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import source_name
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec, VolumeSource
from volprep_formats.tree import files_below

NAME = "import"
"""Name of the stage."""


def import_key(specs: Sequence[SourceSpec], version: str, segments: Iterable[SegmentSource] = ()) -> str:
    """Digest of the source: settings and files of each channel, with the files' sizes and times of change.

    It includes the files of segments, if there are any.

    Only drafts hold it. The digest of the values themselves would cost a whole reading.
    """
    states = [state for spec in specs for place in spec.places() for state in _states(place)]
    described: list[object] = [version, [spec.model_dump(mode="json") for spec in specs], states]
    described += [
        [source.table, source.smoothing_mm, [[os.fspath(file), _states(file)] for file in source.files]]
        for source in segments
    ]
    text = json.dumps(described)
    return hashlib.sha256(text.encode()).hexdigest()


def _states(source: Path) -> list[tuple[str, int, int]]:
    """Path, size and time of change of a file, or of all files below a folder."""
    states: list[tuple[str, int, int]] = []
    with suppress(OSError):  # the reader of the source reports the error
        for file in files_below(source) if source.is_dir() else [source]:
            found = file.stat()
            states.append((os.fspath(file), found.st_size, found.st_mtime_ns))
    return sorted(states)


def import_volume(draft: Draft, source: VolumeSource, progress: Progress, channel: str) -> Measured:
    """Write the stored values of a source to the draft, as a channel; return the measurements.

    Raises the errors of the reader, VP1090 for NaN or infinite voxels, VP4020 where the draft cannot be written.
    """
    gauge = SlabMeasurer(source.info)
    progress.start("import", source.info.grid.shape_zyx[0])
    slabs = source_slabs(source, gauge, progress)
    size = math.prod(source.info.grid.shape_zyx) * np.dtype(source.info.stored_type).itemsize
    written = draft.write(source_name(channel), "work", (bytes_of(slab) for slab in slabs), needed_bytes=size)
    return gauge.result(written.sha256)

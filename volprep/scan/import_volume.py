"""A source becomes one volume with exact geometry and full precision, and is measured in the same pass.

Import comes before the plan, which needs what it measures; so it is no `Stage`.
"""

import hashlib
import json
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from volprep.scan.slabs import bytes_of
from volprep.scan.statistics import Gauge, Measured, source_slabs
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import source_name
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec, VolumeSource
from volprep_formats.tree import files_below

NAME = "import"
"""Name of the stage."""


def import_key(specs: Sequence[SourceSpec], version: str) -> str:
    """Digest of what the source is: where, and of which files with their sizes and times of change, for each channel.

    Only drafts hold it. The digest of the values themselves would cost a whole reading.
    """
    states = [state for spec in specs for place in spec.places() for state in _states(place)]
    text = json.dumps([version, [spec.model_dump(mode="json") for spec in specs], states])
    return hashlib.sha256(text.encode()).hexdigest()


def _states(source: Path) -> list[tuple[str, int, int]]:
    """Path, size and time of change of a file, or of all files below a folder."""
    states: list[tuple[str, int, int]] = []
    with suppress(OSError):  # whoever reads the source says what is wrong with it
        for file in files_below(source) if source.is_dir() else [source]:
            found = file.stat()
            states.append((os.fspath(file), found.st_size, found.st_mtime_ns))
    return sorted(states)


def import_volume(draft: Draft, source: VolumeSource, progress: Progress, channel: str) -> Measured:
    """Write the stored values of a source to the draft, as those of a channel; return what was measured.

    Raises what the reader raises, VP1090 for voxels that are no numbers, VP4020 where the draft cannot be written.
    """
    gauge = Gauge(source.info)
    progress.start("import", source.info.grid.shape_zyx[0])
    slabs = source_slabs(source, gauge, progress)
    written = draft.write(source_name(channel), "work", (bytes_of(slab) for slab in slabs))
    return gauge.result(written.sha256)

"""The scan of a draft as a field of physical values, as the oracle takes it."""

import numpy as np
from numpy.typing import NDArray

from volprep.parts.work import source_volume
from volprep.truth.decoded import light_of_scan
from volprep.truth.volume import Volume
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.storage.draft import Draft


def source_field(draft: Draft, view: Manifest) -> Volume:
    """Return the scan of the channel that `view` shows, which the system maps into memory as it is read."""
    channel = view.channels[0]
    raw = source_volume(draft, channel.name)
    stored: NDArray[np.generic] = np.memmap(raw.path, raw.dtype.newbyteorder("<"), "r", shape=raw.shape_zyx)
    info = channel.source.info
    return Volume(stored, info.grid, info.slope, info.intercept, view.holds_labels, light_of_scan(view))

"""Pre-integrated tables: the kernel against NumPy.

There is no public library for the job: programs that pre-integrate do it on the GPU, or leave out the attenuation
inside a segment. NumPy sums 256 sub-samples of each segment, which leaves an error of some 1e-4 where the kernel's is
below 1e-9.
"""

from collections.abc import Iterator

import numpy as np

from volprep.kernels import _native

from .contest import Contest

_ENTRIES = 256
_SUBSAMPLES = 256
_ROWS = 16


def contests() -> Iterator[Contest]:
    """One table of 256 × 256 entries, for a transfer function of ten points."""
    rng = np.random.default_rng(1)
    values = np.linspace(0.0, 255.0, 10)
    colours, extinctions = rng.random((10, 3)), rng.random(10) * 5
    entries = np.linspace(0.0, 255.0, _ENTRIES)
    back, front = (np.ascontiguousarray(each).ravel() for each in np.meshgrid(entries, entries, indexing="ij"))
    light = np.empty((front.size, 4))

    def by_numpy() -> None:
        share = (np.arange(_SUBSAMPLES) + 0.5) / _SUBSAMPLES
        for start in range(0, front.size, _ROWS * _ENTRIES):
            near, far = (each[start : start + _ROWS * _ENTRIES, None] for each in (front, back))
            at = near + share * (far - near)
            depth = np.cumsum(np.interp(at, values, extinctions), axis=1) * (0.5 / _SUBSAMPLES)
            through = np.exp(-depth)
            weight = np.concatenate([np.ones((len(at), 1)), through[:, :-1]], axis=1) - through
            shine = [(weight * np.interp(at, values, channel)).sum(axis=1) for channel in colours.T]
            light[start : start + len(at), :3] = np.stack(shine, axis=1) / np.maximum(1 - through[:, -1:], 1e-12)
            light[start : start + len(at), 3] = depth[:, -1] / 0.5

    yield Contest(
        work="pre-integrated table, 256 × 256 entries",
        source=np.stack([front, back]),
        bytes_written=light.nbytes,
        ours=lambda: _native.preintegrate(front, back, values, colours, extinctions, 0.5, light),
        peers={"numpy, 256 sub-samples": by_numpy},
    )

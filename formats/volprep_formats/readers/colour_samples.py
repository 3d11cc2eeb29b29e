"""Samples of a pixel that a reader keeps: one as it is, or all as one channel of a volume in colour."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.readers.colour import channel_of_colours
from volprep_formats.source import ColourChannel


@dataclass(frozen=True)
class OneSample:
    """One of the samples."""

    index: int
    """Its number."""

    def dtype(self, stored: str) -> str:
        """Return the type of the values that are kept of samples of type `stored`."""
        return stored

    def span(self, _count: int) -> tuple[int, int]:
        """Return the first sample that is needed of `count`, and the one after the last."""
        return self.index, self.index + 1

    def kept(self, _path: Path, samples: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return the values that are kept [...] of the samples [..., n] that are needed."""
        return samples[..., 0]


@dataclass(frozen=True)
class ColourSamples:
    """A channel of red, green, blue and, as a fourth sample, alpha, which colours are not multiplied by."""

    channel: ColourChannel
    """The channel."""

    def dtype(self, _stored: str) -> str:
        """Return the type of the channel."""
        return self.channel.dtype

    def span(self, count: int) -> tuple[int, int]:
        """Return that all samples are needed."""
        return 0, count

    def kept(self, path: Path, samples: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return the channel [...] of samples [..., n]. Raises VP1290."""
        alpha = samples[..., 3] if samples.shape[-1] == 4 else None
        return channel_of_colours(path, self.channel, samples if alpha is None else samples[..., :3], alpha)

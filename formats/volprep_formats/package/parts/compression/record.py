"""Records of the compressed forms considered for the levels, and the loss of each."""

from typing import Annotated, get_args

from pydantic import Field

from volprep_formats.grid import Index
from volprep_formats.package.values import ByteCount, open_word
from volprep_formats.record import Record
from volprep_formats.source import ChannelName
from volprep_formats.textures.block_formats import CompressedFormat

NonNegative = Annotated[float, Field(ge=0.0)]


class CompressedForm(Record):
    """One form of the finest level, encoded and decoded again."""

    format: Annotated[str, open_word(*get_args(CompressedFormat))]
    """Format of its textures. A reader accepts any other word for a form that is not kept."""
    channel: ChannelName
    """Channel for which it was considered."""
    kept: bool
    """Whether the package uses it."""
    level: Index
    """The finest level that fits."""
    size_bytes: ByteCount
    """Size of the textures of that level."""
    basis: Annotated[str, open_word("level", "sample")]
    """Scope of the test. "level": the whole level was encoded; the oracle drew its standard views. "sample": a sample
    of the source, with rays along z, was encoded; it was enough to refuse the form, or the plan was made without a
    build. A reader accepts any other word."""
    pictures: Annotated[int, Field(ge=1, le=2**53 - 1)]
    """Number of standard views that were drawn, of all transfer functions together, until one was beyond half of the
    tolerance; 1 for the rays of a sample."""
    psnr_db: float | None = None
    """Peak signal to noise of the codes; null if nothing is lost."""
    rmse: NonNegative
    """Largest root mean square error of a picture, in premultiplied linear values from 0 to 1. Level 0 is compared with
    the source, a coarser level with means of its values, a sample with its codes."""
    maximum: NonNegative
    """Largest error of one channel of one pixel of these pictures."""

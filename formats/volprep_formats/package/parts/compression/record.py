"""What a package says about compressed forms of its levels: those that were considered, and what each would lose."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record
from volprep_formats.source import ChannelName
from volprep_formats.textures.block_formats import CompressedFormat

NonNegative = Annotated[float, Field(ge=0.0)]


class CompressedForm(Record):
    """One form of the finest level, encoded and decoded again."""

    format: CompressedFormat
    """Format of its textures."""
    channel: ChannelName
    """Channel that it was considered for."""
    kept: bool
    """Whether the package has it."""
    level: Annotated[int, Field(ge=0)]
    """The finest level that fits."""
    size_bytes: ByteCount
    """Size of the textures of that level."""
    basis: Literal["level", "sample"]
    """What was encoded. "level": the whole level; the oracle drew its standard views. "sample": a sample of the source,
    with rays along z; it was enough to refuse the form, or the plan was made without a build."""
    pictures: Annotated[int, Field(ge=1)]
    """Number of standard views that were drawn, of all transfer functions together, until one was beyond half of the
    tolerance; 1 for the rays of a sample."""
    psnr_db: float | None
    """Peak signal to noise of the codes; null if nothing is lost."""
    rmse: NonNegative
    """Largest root mean square error of a picture, in premultiplied linear values from 0 to 1. Level 0 is compared with
    the source, a coarser level with means of its values, a sample with its codes."""
    maximum: NonNegative
    """Largest error of one channel of one pixel of these pictures."""

"""Costs of drawing one level with one transfer function, for an app to read before it loads."""

from volprep_formats.grid import Index
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record


class DrawCost(Record):
    """Bytes that a device takes to draw one level with one transfer function, in every view and size of picture.

    Textures that the program reads, and the mesh where rays begin at one. Pictures, depth buffers and shaders are not
    counted: they depend on the app and on the driver.
    """

    transfer: str
    """Name of the transfer function, or of the picture of several channels."""
    level: Index
    """Level that is drawn."""
    upload_bytes: ByteCount
    """Bytes of texels, vertices and indices that the app uploads to OpenGL ES."""
    gpu_bytes: ByteCount
    """Memory of the uploaded data. A texel of three bytes counts as four, and one of a palette as four: many drivers
    keep them so."""

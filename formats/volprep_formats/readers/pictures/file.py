"""Picture files (PNG, TIFF, JPEG, OpenEXR, BMP) as pages of one grey value for each pixel, through OpenImageIO.

Its decoders are foreign code: `read_headers` and `decode_request` have their work done in worker processes, which alone
import it.
Values are given as they are stored, without premultiplication; only volumes in colour are converted to sRGB
(`profile.py`). Fewer than 8, or 16, bits are spread over the whole range of 8, or 16, as OpenImageIO does.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.isolation import WorkerRequest, Workers
from volprep_formats.path_text import unicode_path
from volprep_formats.progress import Progress
from volprep_formats.readers.colour import channel_of_colours, colour_remarks
from volprep_formats.readers.grey import grey_of, grey_remark
from volprep_formats.readers.ome.tiff_chain import count_pages
from volprep_formats.readers.pictures.description import FM_PER_MM, PixelDensity, order_of, spacing_fm_zyx
from volprep_formats.readers.pictures.kinds import kind_of
from volprep_formats.readers.pictures.profile import GAMMA, PROFILE, colour_note, colour_note_remarks, in_srgb
from volprep_formats.regular_files import open_regular
from volprep_formats.source import ColourChannel, GreyOf, StoredType

MAX_PIXELS = 2**28
"""Most pixels that one page may have."""
MAX_PAGES = 2**16
MAX_RATIO = 2**16
"""No picture unpacks to more times its size. Deflate reaches 1032, LZW 2730, a blank fax page as bytes 40,000."""
# End markers of complete files. libjpeg, for one, fills missing pixels with grey without a warning.
_ENDS = {"png": b"IEND\xaeB`\x82", "jpeg": b"\xff\xd9"}
_TAIL_BYTES = 4096
_WHITE_IS_ZERO, _BLACK_IS_ZERO = 0, 1
"""PhotometricInterpretation of TIFF."""
_TYPES: dict[str, StoredType] = {
    "uint8": "uint8",
    "int16": "int16",
    "uint16": "uint16",
    "half": "float32",
    "float": "float32",
}
_STORED: tuple[StoredType, ...] = ("uint8", "int16", "uint16", "float32")
_BITS = {"uint8": 8, "int16": 16, "uint16": 16, "float32": 32}
_NOT_CONFIGURED = re.compile(r"(\w{1,20}) compression support is not configured")
"""Message of libtiff about a compression that it was built without."""
_PAGES_AT_ONCE, _PIXELS_AT_ONCE = 16, 2**22
MEMORY_BYTES, MEMORY_BYTES_PER_PIXEL = 2**28, 16
SECONDS, SECONDS_PER_PIXEL = 30.0, 1e-6


@dataclass(frozen=True)
class Page:
    """Properties of a page. All are integers, so that a worker can return them as one row of an array."""

    columns: int
    rows: int
    channels: int
    type_index: int
    """Index in the types that volprep computes with."""
    bits: int
    """Bits of a value in the file."""
    alpha: int
    """Index of the alpha channel, or -1."""
    has_resolution: int
    """1 if the file has a physical resolution."""
    orientation: int
    """Orientation of TIFF and Exif; 1 is upright."""
    is_premultiplied: int
    """1 if colours are multiplied by the alpha channel."""
    slice_fm: int = 0
    """Femtometres from page to page, of the first page of a stack whose description says them; 0 if it does not."""
    row_fm: int = 0
    """Femtometres from row to row, or 0."""
    column_fm: int = 0
    """Femtometres from column to column, or 0."""
    images: int = 1
    """Of the only page of a stack of ImageJ above 4 GB: number of images that follow each other in the file."""
    stains: int = 1
    """Of the first page of a stack: number of its channels, each with images of its own."""
    colour_note: int = 0
    """Colour space of its file (`profile.py`)."""
    frames: int = 1
    """Of the first page of a stack: number of its time points."""
    frame_us: int = 0
    """Microseconds from time point to time point, or 0."""

    @property
    def stored_type(self) -> StoredType:
        """Type of its values."""
        return _STORED[self.type_index]

    @property
    def spacing_mm_zyx(self) -> tuple[float, float, float] | None:
        """Distances between voxels that the file says, in millimetres."""
        z, y, x = (size / FM_PER_MM for size in (self.slice_fm, self.row_fm, self.column_fm))
        return (z, y, x) if z else None

    @property
    def kind(self) -> tuple[int, ...]:
        """The properties that all pages of one volume share."""
        return (
            self.columns,
            self.rows,
            self.channels,
            self.type_index,
            self.bits,
            self.alpha,
            self.orientation,
            self.is_premultiplied,
        )

    @property
    def spread(self) -> bool:
        """Whether its values have fewer bits than their type."""
        return self.stored_type != "float32" and self.bits < _BITS[self.stored_type]

    def __str__(self) -> str:
        return f"{self.columns}×{self.rows} of {self.channels} channel(s), {self.bits}-bit {self.stored_type}"


@dataclass(frozen=True)
class DecodeRequest:
    """Pages of one file to decode, and their rows and leftmost columns."""

    path: Path
    first: int
    last: int
    row0: int
    row1: int
    columns: int
    page: Page
    """Properties of all the pages."""
    grey: GreyOf | ColourChannel | None = None
    """How colours become one value; None refuses colour pictures."""
    step: int = 1
    """From page to page: with several channels their number."""

    @property
    def pages(self) -> range:
        """Numbers of the pages."""
        return range(self.first, self.last, self.step)

    @property
    def dtype(self) -> np.dtype[np.generic]:
        """Type of the values."""
        return np.dtype(self.grey.dtype if isinstance(self.grey, ColourChannel) else self.page.stored_type)


def read_headers(pool: Workers, files: Sequence[Path], progress: Progress) -> list[tuple[Page, ...]]:
    """Return the pages of each picture file, read in worker processes; each file advances `progress`."""
    pages: list[tuple[Page, ...]] = [()] * len(files)

    def take(index: int, answer: NDArray[np.generic]) -> None:
        pages[index] = tuple(Page(*row) for row in answer.tolist())
        progress.advance()

    pool.run(
        [
            WorkerRequest(_headers, file, file, MAX_PAGES * 8 * len(fields(Page)), MEMORY_BYTES, SECONDS)
            for file in files
        ],
        take,
    )
    return pages


def pages_at_once(rows: int, columns: int) -> int:
    """Number of pages of this size per request: few enough for all cores to get some."""
    return max(1, min(_PAGES_AT_ONCE, _PIXELS_AT_ONCE // (rows * columns)))


def page_remarks(page: Page, name: str, *, grey: GreyOf | ColourChannel | None) -> list[str]:
    """Remarks for the user about pictures like `page`, the first page of file `name`."""
    remarks = []
    if isinstance(grey, ColourChannel):
        remarks += colour_remarks(grey, has_alpha=page.alpha >= 0, is_linear=page.stored_type == "float32")
    elif grey is not None and page.channels - (page.alpha >= 0) == 3:
        remarks.append(grey_remark(grey))
    remarks += colour_note_remarks(page.colour_note, in_colour=isinstance(grey, ColourChannel))
    if page.has_resolution and page.spacing_mm_zyx is None:
        remarks.append("the resolution in the pictures is meant for paper and not used")
    if page.spread:
        remarks.append(f"the {page.bits}-bit values of the pictures are spread over all of {page.stored_type}")
    if page.orientation != 1:
        remarks.append(
            f"the orientation {page.orientation} in the pictures is not applied: rows are as they are stored"
        )
    if Path(name).suffix.lower() in {".jpg", ".jpeg"}:
        remarks.append("JPEG pictures have lost detail when they were written")
    return remarks


def decode_request(part: DecodeRequest) -> WorkerRequest:
    """Request values [page, y, x] of type `page.stored_type` from a worker."""
    page = part.page
    values = len(part.pages) * (part.row1 - part.row0) * part.columns
    decoded = page.rows * page.columns * page.channels
    return WorkerRequest(
        _decode,
        part,
        part.path,
        values * part.dtype.itemsize,
        MEMORY_BYTES + MEMORY_BYTES_PER_PIXEL * decoded,
        SECONDS + SECONDS_PER_PIXEL * decoded * len(part.pages),
    )


def _headers(path: Path) -> NDArray[np.generic]:
    with coded_errors(path):
        return np.array([astuple(page) for page in _list_pages(path)], dtype=np.int64)


def _decode(part: DecodeRequest) -> NDArray[np.generic]:
    with coded_errors(part.path):
        return _decode_pages(part)


@contextmanager
def coded_errors(path: Path) -> Iterator[None]:
    """Convert any exception of a decoder on the file `path` into an error with a code."""
    try:
        yield
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    except (VolprepError, MemoryError):
        raise
    except Exception as error:  # on damaged bytes any can come, as for text that is no UTF-8
        raise unsound(path, f"{type(error).__name__} in its decoder") from error


def _list_pages(path: Path) -> list[Page]:
    _check_ends(path)
    picture = opened(path)
    size = path.stat().st_size
    pages: list[Page] = []
    total = 0
    while picture.seek_subimage(len(pages), 0):
        if len(pages) == MAX_PAGES:
            raise VolprepError("VP1166", path=path, what=f"more than {MAX_PAGES} pages")
        page = _page(path, picture.spec())
        total += page.columns * page.rows * page.channels * _BITS[page.stored_type] // 8
        if page.columns * page.rows > MAX_PIXELS or total > size * MAX_RATIO:
            raise VolprepError(
                "VP1167", path=path, columns=page.columns, rows=page.rows, size=size, limit=MAX_PIXELS, page=len(pages)
            )
        pages.append(page)
    if picture.format_name() == "tiff" and count_pages(path, MAX_PAGES) != len(pages):
        raise unsound(path, "its chain of pages is broken")
    if not pages:
        raise unsound(path, picture.geterror())
    picture.close()
    first = opened(path)
    try:
        return _of_stack(path, first.spec(), pages)
    finally:
        first.close()


def _check_ends(path: Path) -> None:
    with open_regular(path) as file:
        kind = kind_of(file.read(8))
        file.seek(max(0, path.stat().st_size - _TAIL_BYTES))
        tail = file.read()
    if kind is None:
        raise unsound(path, "it begins like none of PNG, TIFF, JPEG, OpenEXR and BMP")
    if kind in _ENDS and _ENDS[kind] not in tail:
        raise unsound(path, "its end is missing")


def opened(path: Path) -> Any:
    """Open a picture as OpenImageIO's ImageInput, which has no types. In workers only. Raises VP1165."""
    import OpenImageIO  # noqa: PLC0415 - in workers only

    as_stored = OpenImageIO.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)
    with open_regular(path) as file:
        kind = kind_of(file.read(8))
    picture = OpenImageIO.ImageInput.open(unicode_path(path), as_stored)
    if picture is None or picture.format_name() != kind:
        raise unsound(path, OpenImageIO.geterror())
    return picture


def check_black_is_zero(path: Path, spec: Any) -> None:
    """Raise VP1166 for a TIFF page whose values grow from white to black (MinIsWhite).

    OpenImageIO turns such values around if they have 8 bits, and gives them as they are if they have more; other
    programs do neither or both.
    """
    if spec.get_int_attribute("tiff:PhotometricInterpretation", _BLACK_IS_ZERO) == _WHITE_IS_ZERO:
        raise VolprepError(
            "VP1166", path=path, what=SafeText("values that grow from white to black (TIFF's MinIsWhite)")
        )


def _page(path: Path, spec: Any) -> Page:
    check_black_is_zero(path, spec)
    kind = str(spec.format)
    if spec.deep or spec.depth > 1 or kind not in _TYPES or spec.channelformats:
        what = "deep pixels" if spec.deep else f"{spec.depth} layers" if spec.depth > 1 else f"pixels of type {kind}"
        raise VolprepError("VP1166", path=path, what="channels of several types" if spec.channelformats else what)
    if min(spec.width, spec.height, spec.nchannels) < 1:
        raise unsound(path, f"it has {spec.width}×{spec.height} pixels of {spec.nchannels} channels")
    stored = _TYPES[kind]
    return Page(
        spec.width,
        spec.height,
        spec.nchannels,
        _STORED.index(stored),
        spec.get_int_attribute("oiio:BitsPerSample", 16 if kind == "half" else _BITS[stored]),
        spec.alpha_channel,
        int(spec.getattribute("XResolution") is not None),
        spec.get_int_attribute("Orientation", 1),
        int(spec.alpha_channel >= 0 and not spec.get_int_attribute("oiio:UnassociatedAlpha", 0)),
        colour_note=colour_note(spec),
    )


def _description(spec: Any) -> str:
    try:
        return str(spec.get_string_attribute("ImageDescription"))
    except UnicodeDecodeError:  # ImageJ and OME write ASCII and UTF-8, others any encoding
        return ""


def _of_stack(path: Path, spec: Any, pages: list[Page]) -> list[Page]:
    """Return the pages, the first one with the order and the distances that its description gives. Raises VP1168."""
    description = _description(spec)
    order = order_of(path, description, (len(pages), pages[0].rows, pages[0].columns, pages[0].channels))
    images = order.images if len(pages) == 1 else 1
    first = replace(pages[0], images=images, stains=order.channels, frames=order.frames, frame_us=order.frame_us)
    x, y = (spec.get_float_attribute(name, 0.0) for name in ("XResolution", "YResolution"))
    resolution = PixelDensity(x, y, spec.get_string_attribute("ResolutionUnit", "none"))
    found = spacing_fm_zyx(description, resolution) if order.images > 1 else None
    if found is not None:
        first = replace(first, slice_fm=found[0], row_fm=found[1], column_fm=found[2])
    return [first, *pages[1:]]


def _decode_pages(part: DecodeRequest) -> NDArray[np.generic]:
    picture = opened(part.path)
    page = part.page
    height = part.row1 - part.row0
    result = np.empty((len(part.pages), height, part.columns), part.dtype)
    for index, target in zip(part.pages, result, strict=True):
        found = _page(part.path, picture.spec()) if picture.seek_subimage(index, 0) else None
        if found is None or found.kind != page.kind:
            raise unsound(part.path, f"page {index} has changed")
        values = _values(picture, index, part)
        if values is None or values.size != height * page.columns * page.channels:
            raise unsound(part.path, picture.geterror())
        values = values.reshape(height, page.columns, page.channels)[:, : part.columns]
        if found.colour_note in {PROFILE, GAMMA} and isinstance(part.grey, ColourChannel):
            values = in_srgb(values, picture.spec(), page.alpha, is_premultiplied=bool(page.is_premultiplied))
        target[...] = _grey(part, values)
    picture.close()
    return result


def _values(picture: Any, index: int, part: DecodeRequest) -> NDArray[np.generic] | None:
    page, spec = part.page, picture.spec()
    kind = "float" if page.stored_type == "float32" else page.stored_type
    values: NDArray[np.generic] | None
    if spec.tile_width or (part.row0, part.row1) == (0, page.rows):
        values = picture.read_image(index, 0, 0, page.channels, kind)
        return None if values is None else values[part.row0 : part.row1]
    values = picture.read_scanlines(index, 0, spec.y + part.row0, spec.y + part.row1, spec.z, 0, page.channels, kind)
    return values


def _grey(part: DecodeRequest, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the value that all colour channels share, or the requested conversion."""
    path, page = part.path, part.page
    colours = [channel for channel in range(page.channels) if channel != page.alpha]
    if isinstance(part.grey, ColourChannel):
        alpha = values[..., page.alpha] if page.alpha >= 0 else None
        straight = None if not page.is_premultiplied else alpha
        return channel_of_colours(path, part.grey, values[..., colours], alpha, multiplied_by=straight)
    first: NDArray[np.generic] = values[..., colours[0] if colours else 0]
    if part.grey is not None and len(colours) == 3:
        first = grey_of(values[..., colours], part.grey)
    elif not all(np.array_equal(values[..., channel], first) for channel in colours[1:]):
        raise VolprepError("VP1164", path=path, what=f"{len(colours)} colour channels that differ")
    opaque = 1.0 if page.stored_type == "float32" else np.iinfo(page.stored_type).max
    if colours and page.alpha >= 0 and not (values[..., page.alpha] == opaque).all():
        raise VolprepError("VP1164", path=path, what=SafeText("transparent pixels"))
    return first


def unsound(path: Path, error: str) -> VolprepError:
    """Return VP1165 with the first line of a decoder's message, or VP1166 for a compression that it does not have."""
    # Decoders repeat the whole path in every line.
    line = (error.strip().splitlines() or ["its decoder does not say why"])[0].replace(str(path), path.name)
    if missing := _NOT_CONFIGURED.search(line):
        return VolprepError("VP1166", path=path, what=f"{missing[1]} compression")
    return VolprepError("VP1165", path=path, error=line[:200])

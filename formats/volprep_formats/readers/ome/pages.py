"""Pages of OME-TIFF files, decoded by OpenImageIO in worker processes.

Of a page with smaller copies of itself (SubIFDs) the page itself is read, the finest.
"""

from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.isolation import WorkerRequest
from volprep_formats.readers.colour_samples import ColourSamples, OneSample
from volprep_formats.readers.ome.tiff_chain import count_pages, description_of
from volprep_formats.readers.pictures.file import (
    MAX_PAGES,
    MAX_PIXELS,
    MAX_RATIO,
    MEMORY_BYTES,
    MEMORY_BYTES_PER_PIXEL,
    SECONDS,
    SECONDS_PER_PIXEL,
    check_black_is_zero,
    coded_errors,
    opened,
    unsound,
)

_MOST_TEXT_BYTES = 2**26
_TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")
_TYPE_OF_FORMAT = {"uint": "uint32", "int": "int32", "float": "float32", "double": "float64"}
_FORMAT_OF_TYPE = {dtype: name for name, dtype in _TYPE_OF_FORMAT.items()}


@dataclass(frozen=True)
class TiffPage:
    """Properties of a page. All are integers, so that a worker can return them as one row of an array."""

    rows: int
    columns: int
    samples: int
    """Values of a pixel."""
    type_index: int
    """Index in the types that are read, or -1."""
    bits: int
    """Bits of a value in the file."""

    @property
    def dtype(self) -> str:
        """Type of its values; "other" if it is not read."""
        return _TYPES[self.type_index] if self.type_index >= 0 else "other"

    def __str__(self) -> str:
        return f"{self.columns}×{self.rows} pixels of {self.samples} {self.bits}-bit {self.dtype}"


@dataclass(frozen=True)
class Pages:
    """Pages of one file to decode, and the samples to keep."""

    path: Path
    indices: tuple[int, ...]
    samples: OneSample | ColourSamples
    page: TiffPage
    """Properties of all the pages."""

    @property
    def dtype(self) -> str:
        """Type of the values."""
        return self.samples.dtype(self.page.dtype)


def description_in(path: Path) -> bytes:
    """Return the description in the first page of a TIFF file, without decoding anything. Raises VP1220."""
    text = description_of(path, _MOST_TEXT_BYTES)
    if text is None or b"<OME" not in text:
        raise VolprepError("VP1220", path=path, error=SafeText("there is no OME-XML in its first page"))
    return text


def pages_request(path: Path) -> WorkerRequest:
    """Request the properties of a file's pages; `pages_of` parses the answer."""
    return WorkerRequest(_list_pages, path, path, MAX_PAGES * 8 * 5, MEMORY_BYTES, SECONDS)


def pages_of(answer: NDArray[np.generic]) -> tuple[TiffPage, ...]:
    """Pages from the answer to a `pages_request`."""
    return tuple(TiffPage(*row) for row in answer.tolist())


def decode_request(pages: Pages) -> WorkerRequest:
    """Ask for values [page, y, x] in a worker."""
    page = pages.page
    pixels = page.rows * page.columns
    return WorkerRequest(
        _decode,
        pages,
        pages.path,
        len(pages.indices) * pixels * np.dtype(pages.dtype).itemsize,
        MEMORY_BYTES + 2 * MEMORY_BYTES_PER_PIXEL * pixels * page.samples,
        SECONDS + SECONDS_PER_PIXEL * pixels * page.samples * len(pages.indices),
    )


def _list_pages(path: Path) -> NDArray[np.generic]:
    with coded_errors(path):
        pages: list[TiffPage] = []
        picture = opened(path)
        size = path.stat().st_size
        total = 0
        while picture.seek_subimage(len(pages), 0):
            page = _page(path, picture.spec())
            total += page.rows * page.columns * page.samples * max(1, page.bits // 8)
            if len(pages) == MAX_PAGES:
                raise VolprepError("VP1225", path=path, size="more pages", limit=f"{MAX_PAGES} pages")
            if page.rows * page.columns > MAX_PIXELS or total > size * MAX_RATIO:
                raise VolprepError(
                    "VP1225",
                    path=path,
                    size=f"{page.columns}×{page.rows} pixels in page {len(pages)}",
                    limit=f"{MAX_PIXELS} pixels, or than a file of {size} bytes can hold",
                )
            pages.append(page)
        if count_pages(path, MAX_PAGES) != len(pages) or not pages:
            raise unsound(path, "its chain of pages is broken")
        picture.close()
        return np.array([astuple(page) for page in pages], dtype=np.int64)


def _page(path: Path, spec: Any) -> TiffPage:
    check_black_is_zero(path, spec)
    if min(spec.width, spec.height, spec.nchannels) < 1:
        raise unsound(path, f"it has {spec.width}×{spec.height} pixels of {spec.nchannels} channels")
    name = str(spec.format)
    dtype = _TYPE_OF_FORMAT.get(name, name)
    known = dtype in _TYPES and spec.depth == 1 and not spec.channelformats and not spec.deep
    bits = spec.get_int_attribute("oiio:BitsPerSample", 8 * np.dtype(dtype).itemsize if known else 0)
    return TiffPage(spec.height, spec.width, spec.nchannels, _TYPES.index(dtype) if known else -1, bits)


def _decode(pages: Pages) -> NDArray[np.generic]:
    page, path = pages.page, pages.path
    with coded_errors(path):
        result = np.empty((len(pages.indices), page.rows, page.columns), pages.dtype)
        picture = opened(path)
        for index, target in zip(pages.indices, result, strict=True):
            if not picture.seek_subimage(index, 0) or _page(path, picture.spec()) != page:
                raise unsound(path, f"page {index} has changed")
            kind = _FORMAT_OF_TYPE.get(page.dtype, page.dtype)
            first, last = pages.samples.span(page.samples)
            values = picture.read_image(index, 0, first, last, kind)
            if values is None or values.size != target.size * (last - first):
                raise unsound(path, picture.geterror())
            target[...] = pages.samples.kept(path, values.reshape(*target.shape, last - first))
        picture.close()
        return result

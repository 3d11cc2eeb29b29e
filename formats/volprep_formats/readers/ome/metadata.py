"""OME-XML: the images, channels, time points and pages of an OME-TIFF.

Read as a stream of tags; only the geometry and the page table are kept, because the XML may contain names of people. A
document type is refused, and with it all entities. Source: OME model 2016-06, "OME-TIFF specification" and "Pixels"
(https://docs.openmicroscopy.org/ome-model/).
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.regular_files import is_there

_MOST_ELEMENTS = 2**21
_MOST_PLANES = 2**20
_LONGEST_NAME = 200

Attributes = dict[str, str]


@dataclass
class TiffData:
    """Location of planes: pages of files."""

    attributes: Attributes
    file_name: str | None = None
    uuid: str = ""


@dataclass
class Image:
    """One image of a file: up to five axes."""

    name: str = ""
    pixels: Attributes = field(default_factory=dict)
    channels: list[Attributes] = field(default_factory=list)
    data: list[TiffData] = field(default_factory=list)
    planes: dict[str, Attributes] = field(default_factory=dict)
    """The first plane of each time point that says when it was taken."""


@dataclass
class Description:
    """The whole document."""

    uuid: str = ""
    images: list[Image] = field(default_factory=list)
    metadata_file: str | None = None


@dataclass(frozen=True)
class Sizes:
    """Axes of an image."""

    z: int
    y: int
    x: int
    t: int
    channels: int
    """Channels of pages; with several samples in a pixel, each is a channel of its own beside it."""
    samples: int
    """Samples of a pixel."""
    order: str
    """Order in which pages are counted: Z, C and T, the fastest first."""


def parse_description(path: Path, text: bytes) -> Description:
    """Parse the XML. Raises VP1220 if it is malformed."""
    description = Description()
    parser = expat.ParserCreate("UTF-8")
    _Handlers(path, parser, description)
    try:
        parser.Parse(text.rstrip(b"\0 \r\n\t"), True)
    except expat.ExpatError as error:
        raise VolprepError("VP1220", path=path, error=f"its OME-XML ends in: {error}") from error
    return description


class _Handlers:
    """Builds a description from the parser's events."""

    def __init__(self, path: Path, parser: expat.XMLParserType, description: Description) -> None:
        self._path = path
        self._description = description
        self._open: list[str] = []
        self._count = 0
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.StartDoctypeDeclHandler = self._doctype

    def _doctype(self, *_: object) -> None:
        raise VolprepError(
            "VP1220", path=self._path, error=SafeText("its OME-XML has a document type, which OME never writes")
        )

    def _start(self, name: str, attributes: Attributes) -> None:
        self._count += 1
        if self._count > _MOST_ELEMENTS:
            raise VolprepError("VP1220", path=self._path, error=f"its OME-XML has more than {_MOST_ELEMENTS} elements")
        self._open.append(name.rpartition(":")[2])
        images = self._description.images
        match self._open:
            case ["OME"]:
                self._description.uuid = attributes.get("UUID", "")
            case ["OME", "BinaryOnly"]:
                self._description.metadata_file = attributes.get("MetadataFile", "")
            case ["OME", "Image"]:
                images.append(Image(attributes.get("Name", "")[:_LONGEST_NAME]))
            case ["OME", "Image", "Pixels"]:
                images[-1].pixels = attributes
            case ["OME", "Image", "Pixels", "Channel"]:
                images[-1].channels.append(attributes)
            case ["OME", "Image", "Pixels", "Plane"] if "DeltaT" in attributes:
                images[-1].planes.setdefault(attributes.get("TheT", "0"), attributes)
            case ["OME", "Image", "Pixels", "TiffData"]:
                images[-1].data.append(TiffData(attributes))
            case ["OME", "Image", "Pixels", "TiffData", "UUID"]:
                images[-1].data[-1].file_name = attributes.get("FileName")

    def _text(self, text: str) -> None:
        if self._open == ["OME", "Image", "Pixels", "TiffData", "UUID"]:
            self._description.images[-1].data[-1].uuid += text.strip()

    def _end(self, _name: str) -> None:
        self._open.pop()


def sizes_of(path: Path, image: Image) -> Sizes:
    """Check the axes of an image. Raises VP1220 for invalid sizes, VP1224 for unsupported pixel types."""
    number = {key: _number(path, image.pixels.get(f"Size{key}"), f"Size{key}") for key in "XYZCT"}
    per_channel = {_number(path, channel.get("SamplesPerPixel", "1"), "SamplesPerPixel") for channel in image.channels}
    samples = min(per_channel, default=1)
    if len(per_channel) > 1:
        raise VolprepError("VP1224", path=path, what=SafeText("channels with different numbers of samples"))
    if number["C"] % samples:
        raise VolprepError("VP1220", path=path, error=f"it has {number['C']} channels in pixels of {samples} samples")
    order = image.pixels.get("DimensionOrder", "")
    if order[:2] != "XY" or sorted(order[2:]) != ["C", "T", "Z"]:
        raise VolprepError("VP1220", path=path, error=f"its order of axes is {order[:20]!r}")
    sizes = Sizes(number["Z"], number["Y"], number["X"], number["T"], number["C"] // samples, samples, order[2:])
    if sizes.z * sizes.channels * sizes.t > _MOST_PLANES or sizes.channels * samples > 2**16:
        planes = f"{sizes.z}×{sizes.channels}×{sizes.t} planes"
        raise VolprepError("VP1225", path=path, size=planes, limit=f"{_MOST_PLANES} planes and {2**16} channels")
    return sizes


def planes_of(path: Path, description: Description, image: Image, sizes: Sizes) -> tuple[NDArray[np.int64], list[str]]:
    """File and page of each plane, [t, c, z, 2], -1 where it has none, and the names of the files.

    File 0 is this one, whatever it is called now; the others lie beside it. Raises VP1220 for planes beyond the axes or
    in two places, VP1226 for a name that leads out of the folder.
    """
    count = {"Z": sizes.z, "C": sizes.channels, "T": sizes.t}
    lengths = [count[axis] for axis in sizes.order]
    total = math.prod(lengths)
    where = np.full((total, 2), -1, np.int64)
    files = _Files(path, description, image)
    for data in image.data or [TiffData({})]:
        told = data.attributes
        first = [_number(path, told.get(f"First{axis}", "0"), f"First{axis}", least=0) for axis in sizes.order]
        if any(at >= length for at, length in zip(first, lengths, strict=True)):
            raise VolprepError("VP1220", path=path, error=f"it begins at a plane beyond its axes: {first}")
        start = first[0] + lengths[0] * (first[1] + lengths[1] * first[2])
        page = _number(path, told.get("IFD", "0"), "IFD", least=0)
        usual = "1" if "IFD" in told else str(total - start)
        planes = _number(path, told.get("PlaneCount", usual), "PlaneCount", least=0)
        if start + planes > total or page > _MOST_PLANES:
            raise VolprepError("VP1220", path=path, error=f"it has {planes} planes from number {start} on, of {total}")
        if (where[start : start + planes] >= 0).any():
            raise VolprepError("VP1220", path=path, error=SafeText("a plane is in two places"))
        where[start : start + planes, 0] = files.index(data)
        where[start : start + planes, 1] = np.arange(page, page + planes)
    if len(image.data) == 1 and (missing := int((where[:, 0] < 0).sum())):
        # One run of pages is counted along the axes: where these are longer than the run, it is of other planes.
        raise VolprepError("VP1220", path=path, error=f"its one run of pages lacks {missing} of {total} planes")
    shaped = where.reshape(*reversed(lengths), 2)
    axes = [sizes.order[::-1].index(axis) for axis in "TCZ"]
    return np.ascontiguousarray(shaped.transpose(*axes, 3)), files.names


class _Files:
    """Numbers of the files that hold planes."""

    def __init__(self, path: Path, description: Description, image: Image) -> None:
        self._path = path
        self._uuid = description.uuid
        told = {data.file_name for data in image.data}
        names = [_plain(path, name) for name in told if name is not None]
        # A file that holds all alone may have been renamed.
        self._is_alone = len(told) == 1 and not any(is_there(path.parent / name) for name in names)
        self.names = [path.name]

    def index(self, data: TiffData) -> int:
        """Return the number of the file of these planes."""
        name = data.file_name
        if name is None or self._is_alone or name == self._path.name or (data.uuid and data.uuid == self._uuid):
            return 0
        if name not in self.names:
            self.names.append(name)
        return self.names.index(name)


def _plain(path: Path, name: str) -> str:
    """A name without a folder. Raises VP1226 for any other."""
    if name in {"", ".", ".."} or set(name) & set("/\\\0") or len(name) > 255:
        raise VolprepError("VP1226", path=path, name=name[:80])
    return name


def _number(path: Path, text: str | None, what: str, least: int = 1) -> int:
    if text is None or not (text.isascii() and text.isdigit() and len(text) <= 10) or not least <= int(text) < 2**31:
        raise VolprepError("VP1220", path=path, error=f"{what} is {(text or '')[:20]!r}")
    return int(text)

"""The XML of VTK image data, read as a stream up to the appended data, which need be no XML.

Nothing is kept but what places the volume and its arrays. A document type is refused, and with it all entities; tags
and their number have limits.
"""

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.regular_files import open_regular

_CHUNK_BYTES = 2**18
_MOST_ELEMENTS = 10_000
_LONGEST_TAG = 2**20

Attributes = dict[str, str]


@dataclass
class Array:
    """A DataArray of the points: its attributes, and where its tag and its end tag begin in the file."""

    attributes: Attributes
    tag_bytes: int
    end_bytes: int = 0


@dataclass
class Document:
    """Content of the XML, up to the appended data."""

    root: Attributes = field(default_factory=dict)
    image: Attributes | None = None
    pieces: list[Attributes] = field(default_factory=list)
    points: Attributes = field(default_factory=dict)
    arrays: list[Array] = field(default_factory=list)
    cell_arrays: int = 0
    appended: tuple[str, int] | None = None
    """Encoding, and where the tag begins."""


class _Done(Exception):  # noqa: N818 - ends the parser at the appended data, which may be no XML
    pass


def parse_image(path: Path) -> Document:
    """Read the XML, to the appended data if there are any; then they need not be XML."""
    document = Document()
    parser = expat.ParserCreate("UTF-8")
    _Handlers(path, parser, document)
    with open_regular(path) as file:
        try:
            while chunk := file.read(_CHUNK_BYTES):
                parser.Parse(chunk, False)
                # Text is handed on as it comes, so only an endless tag makes the parser hold back this much.
                if file.tell() - parser.CurrentByteIndex > _LONGEST_TAG + _CHUNK_BYTES:
                    raise VolprepError("VP1140", path=path, error=SafeText("one of its tags has no end"))
            parser.Parse(b"", True)
        except _Done:
            pass
        except expat.ExpatError as error:
            raise VolprepError("VP1140", path=path, error=error) from error
    if document.root.get("type") != "ImageData" or document.image is None:
        kind = document.root.get("type", "nothing")[:40]
        raise VolprepError("VP1142", path=path, what=f"{kind} instead of ImageData")
    return document


class _Handlers:
    """Builds a document from the parser's events."""

    def __init__(self, path: Path, parser: expat.XMLParserType, document: Document) -> None:
        self._path = path
        self._parser = parser
        self._document = document
        self._open: list[str] = []
        self._count = 0
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.StartDoctypeDeclHandler = self._doctype

    def _doctype(self, *_: object) -> None:
        raise VolprepError("VP1140", path=self._path, error=SafeText("it has a document type, which VTK never writes"))

    def _start(self, name: str, attributes: Attributes) -> None:
        self._count += 1
        if self._count > _MOST_ELEMENTS:
            raise VolprepError("VP1140", path=self._path, error=f"it has more than {_MOST_ELEMENTS} elements")
        document, position = self._document, self._parser.CurrentByteIndex
        self._open.append(name)
        match self._open:
            case ["VTKFile"]:
                document.root = attributes
            case ["VTKFile", "ImageData"]:
                if document.image is not None:
                    raise VolprepError("VP1140", path=self._path, error=SafeText("it has two images"))
                document.image = attributes
            case ["VTKFile", "ImageData", "Piece"]:
                document.pieces.append(attributes)
            case ["VTKFile", "ImageData", "Piece", "PointData"]:
                document.points = attributes
            case ["VTKFile", "ImageData", "Piece", "PointData", "DataArray"]:
                document.arrays.append(Array(attributes, position))
            case ["VTKFile", "ImageData", "Piece", "PointData", "DataArray", "InformationKey"]:
                # VTK writes facts about an array, as its range of lengths, after the numbers.
                document.arrays[-1].end_bytes = document.arrays[-1].end_bytes or position
            case ["VTKFile", "ImageData", "Piece", "CellData", "DataArray"]:
                document.cell_arrays += 1
            case ["VTKFile", "AppendedData"]:
                document.appended = (attributes.get("encoding", ""), position)
                raise _Done

    def _end(self, _name: str) -> None:
        if self._open[-2:] == ["PointData", "DataArray"] and self._document.arrays:
            array = self._document.arrays[-1]
            array.end_bytes = array.end_bytes or self._parser.CurrentByteIndex
        self._open.pop()

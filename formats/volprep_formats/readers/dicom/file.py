"""Recognise a DICOM file and list its slices. Source: DICOM PS3.10 (file format)."""

from pathlib import Path

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.dicom.header import SliceImage, slice_image
from volprep_formats.readers.dicom.inflate import DEFLATED, meta_end_bytes
from volprep_formats.readers.dicom.kind import SUFFIXES, has_prefix
from volprep_formats.readers.dicom.mosaic import is_mosaic, mosaic_slices
from volprep_formats.readers.dicom.plain import PlainHeader

NO_HEADER = SafeText("it has no DICOM header")
_HEAD_BYTES = 2**12
_DIRECTORY = b"\2\0\2\0UI\x14\x001.2.840.10008.1.3.10"
"""Class of a DICOMDIR, which lists the files of a medium. The files themselves are read, however damaged it is."""
_BARE_BEGINNINGS = frozenset((b"\x02\0\0\0", b"\x08\0\0\0", b"\x08\0\x05\0", b"\x08\0\x08\0", b"\x08\0\x16\0"))


def slices_of(path: Path, plain: PlainHeader | None) -> tuple[SliceImage, ...]:
    """Return the slices of a DICOM file, reading its header unless it is plain; none for a valid file without an image.

    Raises VolprepError VP1003 when the file cannot be read, VP1032 when it begins as DICOM and cannot be parsed, VP1031
    when it ends within its header, or has a DICOM name and other content. Lesser errors are in the `problem` of a
    returned slice, which may then be the whole picture.
    """
    if plain is None:
        return _unusual_slices(path)
    image = slice_image(path, plain.elements, plain.transfer_syntax, plain.pixels)
    return mosaic_slices(image, plain.elements) if is_mosaic(plain.elements) else (image,)


def _unusual_slices(path: Path) -> tuple[SliceImage, ...]:
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
            if _DIRECTORY in head:
                return ()
            cut_off = has_prefix(head) and path.stat().st_size < meta_end_bytes(head)
            if _looks_like_dicom(head) and not cut_off:
                from volprep_formats.readers.dicom.any_file import any_slices  # noqa: PLC0415 - heavy, and seldom needed

                file.seek(0)
                return any_slices(path, file, deflated=DEFLATED.encode() in head)
    except VolprepError:
        raise
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    except Exception as error:  # pydicom lets any error of a parser through on damaged bytes
        if has_prefix(head):
            raise VolprepError("VP1032", path=path, error=type(error).__name__) from error
        return ()
    if cut_off:
        raise VolprepError("VP1031", path=path, what=SafeText("it ends before its data set begins"))
    # macOS leaves a "._NAME" with its own data beside NAME.
    if path.suffix.lower() in SUFFIXES and not path.name.startswith("._"):
        raise VolprepError("VP1031", path=path, what=NO_HEADER)
    return ()


def _looks_like_dicom(head: bytes) -> bool:
    # Old software left out the prefix, and with it group 0002 or not: such files begin with the length of that group,
    # or with the length of group 0008, the character set, the image type or the class, little endian.
    return has_prefix(head) or head[:4] in _BARE_BEGINNINGS

"""The header of any DICOM file, parsed by pydicom: frames, deflated and big-endian data sets, old and odd files.

Source: DICOM PS3.10 (file format), PS3.5 (A.5 deflated data sets).
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import pydicom
from pydicom import config
from pydicom.dataset import Dataset
from pydicom.filereader import read_dataset, read_file_meta_info
from pydicom.tag import BaseTag
from pydicom.uid import UID, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.dicom.data_set import elements_of, sequence
from volprep_formats.readers.dicom.element import PIXEL_DATA, pixel_element
from volprep_formats.readers.dicom.fields import PRIVATE_TAGS, TAGS, raw_text, raw_value
from volprep_formats.readers.dicom.frames import frame_count, frame_slices
from volprep_formats.readers.dicom.header import SliceImage, slice_image
from volprep_formats.readers.dicom.inflate import inflated_data_set
from volprep_formats.readers.dicom.mosaic import is_mosaic, mosaic_slices
from volprep_formats.readers.dicom.value_table import with_table

_TAGS: list[BaseTag | int] = [*TAGS.values(), *PRIVATE_TAGS]


@contextmanager
def quiet_pydicom() -> Iterator[None]:
    """Silence the validation and warnings of pydicom: volprep has its own checks and messages."""
    with config.disable_value_validation(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def any_slices(path: Path, file: BinaryIO, *, deflated: bool) -> tuple[SliceImage, ...]:
    """Slices of a DICOM file; none when it is sound but holds no image.

    Raises VolprepError VP1031 when it ends within its header, and whatever pydicom lets through on damaged bytes.
    """
    with quiet_pydicom():
        return _slices(path, file, deflated=deflated)


def _slices(path: Path, file: BinaryIO, *, deflated: bool) -> tuple[SliceImage, ...]:
    if deflated:
        meta = read_file_meta_info(path)
        with inflated_data_set(path) as stream:
            data = read_dataset(stream, False, True, stop_when=_at_pixels, specific_tags=_TAGS)
            return _slices_of(path, stream, data, meta, (False, True))
    whole = pydicom.dcmread(file, stop_before_pixels=True, force=True, specific_tags=_TAGS)
    implicit, little = whole.original_encoding
    return _slices_of(path, file, whole, whole.file_meta, (bool(implicit), bool(little)))


def _slices_of(
    path: Path, stream: BinaryIO, data: Dataset, meta: Dataset, encoding: tuple[bool, bool]
) -> tuple[SliceImage, ...]:
    """Return the slices of a parsed header; `stream` is at the pixels, `encoding` is implicit VR and little endian."""
    implicit, little = encoding
    syntax = UID(str(meta.get("TransferSyntaxUID", ""))) or _bare_syntax(implicit, little)
    encapsulated = syntax.is_transfer_syntax and syntax.is_encapsulated
    element = pixel_element(stream, implicit, little, encapsulated=encapsulated)
    elements = elements_of(data)
    sop_class = UID(str(meta.get("MediaStorageSOPClassUID", "")) or raw_text(elements, "SOPClassUID"))
    if element is None:
        if not raw_value(elements, "Rows")[0] and "Image Storage" not in sop_class.name:
            return ()
        # Not kept for later as the problem of this image: even the series that it names may be cut off.
        raise VolprepError("VP1031", path=path, what=SafeText("it ends before the pixel data"))
    image = slice_image(path, elements, str(syntax), element)
    image = replace(image, has_real_world_values=bool(sequence(data, "RealWorldValueMappingSequence")))
    frames = frame_count(data)
    slices: tuple[SliceImage, ...] = (image,)
    if frames is not None:
        slices = frame_slices(image, data, element, frames)
    elif is_mosaic(elements):
        slices = mosaic_slices(image, elements)
    tables = sequence(data, "ModalityLUTSequence")
    return tuple(with_table(part, elements_of(tables[0])) for part in slices) if tables else slices


def _at_pixels(tag: BaseTag, _vr: str | None, _length: int) -> bool:
    return tag.group == PIXEL_DATA >> 16


def _bare_syntax(implicit: bool, little: bool) -> UID:
    """Transfer syntax of a file that does not name it."""
    if implicit:
        return ImplicitVRLittleEndian
    return ExplicitVRLittleEndian if little else ExplicitVRBigEndian

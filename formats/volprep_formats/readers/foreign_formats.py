"""Formats without a reader, recognised by first bytes or names: their description, and how to convert them."""

import re
from dataclasses import dataclass
from pathlib import Path

from volprep_formats.readers.dicom.kind import has_prefix

_SLICER = "Open it in 3D Slicer and save it as NRRD."
_FIJI = "Open it in Fiji (Bio-Formats) and save it as OME-TIFF, or convert it with bioformats2raw."
_MESH = (
    "A mesh has no values inside. Make a volume of it first: voxelize it in 3D Slicer or pyvista, and save it as NRRD."
)
_UNPACK = "Unpack it, and name the folder or the file that was in it."


@dataclass(frozen=True)
class Other:
    """A format that is known by sight."""

    what: str
    """Name of the format, with an article."""
    how: str
    """How to convert it."""


_BY_HEAD: tuple[tuple[re.Pattern[bytes], Other], ...] = tuple(
    (re.compile(pattern, re.DOTALL), Other(what, how))
    for pattern, what, how in (
        (rb"# vtk DataFile[^\n]*\n[^\n]*\n\s*\w+\s+DATASET\s+(?i:POLYDATA|UNSTRUCTURED_GRID)", "a VTK mesh", _MESH),
        (rb".{0,400}<VTKFile[^>]*type=.(?:PolyData|UnstructuredGrid)", "a VTK mesh", _MESH),
        (rb"solid [^\0]{0,300}\bfacet", "an STL mesh", _MESH),
        (rb"ply\r?\n", "a PLY mesh", _MESH),
        (rb"glTF", "a glTF mesh", _MESH),
        (rb"OFF\s", "an OFF mesh", _MESH),
        (rb"\x89HDF\r\n\x1a\n", "an HDF5 file (Imaris, NeXus or MATLAB 7.3)", _SLICER + " Imaris: " + _FIJI),
        (rb"CDF[\x01\x02\x05]", "a NetCDF file", "Save its variable as a NumPy array, for example with xarray."),
        (rb"MATLAB 5\.0 MAT-file", "a MATLAB file", "Save the array from MATLAB with niftiwrite."),
        (rb"ZISRAWFILE", "a Zeiss CZI file", _FIJI),
        (rb"\x70\0\0\0....\x2a", "a Leica LIF file", _FIJI),
        (rb"\xda\xce\xbe\x0a", "a Nikon ND2 file", _FIJI),
        (rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an OLE file (Zeiss ZVI, Olympus OIB or an office document)", _FIJI),
        (rb"# === DATA DESCRIPTION FILE", "the header of a Philips PAR/REC scan", "Convert it with dcm2niix."),
        (rb"MATRIX7", "an ECAT 7 scan", "Convert it to NIfTI with nibabel or 3D Slicer."),
        (rb"PVM[23]?\r?\n|DDS v3[de]", "a PVM or DDS volume of the V3 package", "Convert it with pvm2raw of V3."),
        (rb"#INRIMAGE", "an INRIMAGE volume", _SLICER),
        (rb"11111\n", "an SLC volume of VolVis", "Open it in ParaView and save it as .vti."),
        (rb"# AmiraMesh|# Avizo", "an Amira mesh file", "Export it from Amira as NRRD or raw."),
        (rb"%PDF", "a PDF document", "Get the images themselves, as DICOM."),
        (rb"\x1aE\xdf\xa3|....ftyp", "a film", "Get the slices themselves, as DICOM or as pictures."),
        (rb"GIF8|RIFF....WEBP", "a GIF or WebP picture", "Save the slices as PNG or TIFF."),
        (rb"7z\xbc\xaf'\x1c|Rar!|\xfd7zXZ|BZh|\x28\xb5\x2f\xfd", "a packed archive", _UNPACK),
        (
            # Elements of groups 0002 and 0008: explicit, implicit with text or a length of the group, big endian.
            rb"\x02\0\0\0UL\x04\0|\x08\0.\0(?:[A-Z]{2}|.{2}\0\0[ -~]{4}|\x04\0\0\0.{4}\x08\0)|\0\x08\0.[A-Z]{2}",
            "a DICOM file without its header, 128 bytes and DICM",
            "Write it with one: dcmconv IN.dcm OUT.dcm, of DCMTK.",
        ),
        (rb"NanoVDB[0-2]", "a NanoVDB file", "Convert it to OpenVDB: nanovdb_convert IN.nvdb OUT.vdb, of OpenVDB."),
        (
            rb"HSF-OCT-",
            "a Heidelberg OCT volume",
            "Export it from Heidelberg Eye Explorer as DICOM or TIFF, or convert it with eyepy.",
        ),
        (rb"TRACK\0", "a file of streamlines", "It has no voxels: name the volume that it was traced in."),
        (rb"PK\x03\x04", "a zip archive", _UNPACK),
        (rb".{257}ustar", "a tar archive", _UNPACK),
    )
)
_PACKED_DICOM = Other("a DICOM file packed by gzip", "Unpack it with gunzip, and name the file or its folder.")
_DICOM = Other(
    "a DICOM file without an image, such as a DICOMDIR or a report", "Name the folder that holds the images themselves."
)
_BY_NAME: dict[str, Other] = {
    ".stl": Other("an STL mesh", _MESH),
    ".obj": Other("an OBJ mesh", _MESH),
    ".vtp": Other("a VTK mesh", _MESH),
    ".head": Other("the header of an AFNI scan", "Convert it with 3dAFNItoNIFTI."),
    ".brik": Other("a file of voxels of an AFNI scan", "Convert it with 3dAFNItoNIFTI."),
    ".rec": Other("a file of voxels of a Philips PAR/REC scan", "Convert it with dcm2niix."),
}


def recognised(path: Path, head: bytes, *, is_gzip: bool) -> Other | None:
    """Name the format of a file that nothing here reads, by its first bytes, unpacked; None if it is not known."""
    if has_prefix(head):
        return _PACKED_DICOM if is_gzip else _DICOM
    by_head = next((other for pattern, other in _BY_HEAD if pattern.match(head)), None)
    return by_head or _BY_NAME.get(path.suffix.lower())

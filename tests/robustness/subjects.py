"""Every kind of file that is read, each with a small sound one. A new format adds a line to `SUBJECTS`."""

import gzip
import hashlib
import io
import shutil
import struct
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import nibabel
import numpy as np
import OpenImageIO
import tifffile
from dicom_files import compressed, image, save
from minc_files import minc1, minc2
from numpy.typing import NDArray
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGLSLossless,
    RLELossless,
)
from segment_files import seg, seg_nrrd, structure_set
from tiny_packages import function, lossless, tiny_package
from zarr_stores import multiscales, write_store, zipped

from volprep.scan.segments.fitted import fitted_segments
from volprep.scan.segments.record import found_segments
from volprep_formats.grid import Grid
from volprep_formats.package.manifest_json import decode_manifest, encode_manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST, names_in
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.path_text import path_text
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.segmentations import open_segmentation
from volprep_formats.segmentations.records import Contours, ScanFrame
from volprep_formats.source import RawLayout, SourceSpec, TileLayout
from volprep_formats.textures import ktx2

from . import colour_subjects
from .header_subjects import metaimage_file, nrrd_file, vtk_file
from .mesh_subjects import glb_file, read_mesh

_SHAPE_ZYX = (3, 5, 4)
_COMPRESSED = (RLELossless, JPEGLSLossless, JPEG2000Lossless)


@dataclass(frozen=True)
class Subject:
    """A kind of file."""

    name: str
    suffix: str
    make: Callable[[Path], bytes]
    """Gives the bytes of a small sound file; the path is that of an empty folder to work in."""
    read: Callable[[Path], None]
    """Reads a file whole, and asserts that what it gives agrees with what it said."""
    pack: Callable[[bytes], bytes] = bytes
    """Compresses what has been damaged, which else would never be more than a damaged stream."""
    cases: int = 2000
    """Damaged files that a test reads; fewer where each takes long."""


def read_volume(path: Path, raw: RawLayout | None = None, **told: object) -> None:
    """Read a volume in two slabs and hold it against its description."""
    with open_source(SourceSpec(path=path_text(path), raw=raw, **told), Path(), Silent()) as source:
        info = source.info
        shape = info.grid.shape_zyx
        assert min(shape) > 0
        assert all(0 < spacing < np.inf for spacing in info.grid.spacing_mm_zyx)
        assert np.isfinite([info.slope, info.intercept, *info.grid.origin_mm_xyz]).all()
        assert np.allclose(np.array(info.grid.direction) @ np.array(info.grid.direction).T, np.eye(3), atol=1e-4)
        for z0, z1 in ((0, shape[0] // 2), (shape[0] // 2, shape[0])):
            slab = source.read_slab(z0, z1)
            assert (slab.dtype, slab.shape) == (np.dtype(info.stored_type), (z1 - z0, *shape[1:]))


def _read_colours(path: Path) -> None:
    read_volume(path, colour=colour_subjects.WANTED)


def _noise(shape: tuple[int, ...] = _SHAPE_ZYX) -> NDArray[np.int16]:
    return np.random.default_rng(4).integers(0, 2000, shape).astype(np.int16)


def _zip(data: bytes) -> bytes:
    return gzip.compress(data, compresslevel=1, mtime=0)


def _raw(_folder: Path) -> bytes:
    return _zip(_noise().tobytes())


def _read_raw(path: Path) -> None:
    read_volume(path, RawLayout(shape_zyx=_SHAPE_ZYX, dtype="int16"))


def _nifti(suffix: str, dtype: str, kind: type) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        picture = kind(
            _noise().T.astype(dtype), np.array([[0, -2.0, 0, 5], [1.5, 0, 0, 6], [0, 0, 3, 7], [0, 0, 0, 1]])
        )
        picture.header.set_slope_inter(2, 1)
        file = folder / f"sound{suffix}"
        nibabel.save(picture, file)
        return file.read_bytes()

    return make


def _mgh(_folder: Path) -> bytes:
    whole = nibabel.MGHImage(_noise().T, np.diag([2.0, 1.5, 3.0, 1.0])).to_bytes()
    # The times of the sequence, which may follow the voxels, are not read: a cut in them loses nothing.
    return whole[: 284 + _noise().nbytes]


def _mrc(_folder: Path) -> bytes:
    head = bytearray(1024)
    struct.pack_into("<4i", head, 0, *_SHAPE_ZYX[::-1], 1)
    struct.pack_into("<3i3f3f3i", head, 28, *_SHAPE_ZYX[::-1], 20.0, 15.0, 30.0, 90.0, 90.0, 90.0, 1, 2, 3)
    head[208:216] = b"MAP \x44\x44\0\0"
    return bytes(head) + _noise().tobytes()


def _mrtrix(_folder: Path) -> bytes:
    lines = ("dim: 4,5,3", "vox: 2,1.5,3", "layout: -0,+1,+2", "datatype: Int16LE")
    transform = ("transform: 0,-1,0,7", "transform: 1,0,0,-6", "transform: 0,0,1,5")
    head = "\n".join(["mrtrix image", *lines, *transform, "file: . 200", "END", ""]).encode()
    return head.ljust(200, b"\0") + _noise().tobytes()


def _minc(write: Callable[..., Path]) -> Callable[[Path], bytes]:
    return lambda folder: write(folder / "sound.mnc", _noise(), image__valid_range=(0.0, 2000.0)).read_bytes()


def _npy(_folder: Path) -> bytes:
    file = io.BytesIO()
    np.save(file, _noise())
    return file.getvalue()


def _npz(_folder: Path) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, volume=_noise())
    return file.getvalue()


def _zip_of_array(data: bytes) -> bytes:
    """An archive whose array is damaged, but not the zip around it, whose checksums would tell."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as output:
        output.writestr(zipfile.ZipInfo("volume.npy"), data)
    return stream.getvalue()


def _analyze(_folder: Path) -> bytes:
    header = nibabel.AnalyzeHeader()
    header.set_data_dtype("int16")
    header.set_data_shape(_SHAPE_ZYX[::-1])
    header.set_zooms((2.0, 1.5, 3.0))
    return bytes(header.binaryblock)


def _read_analyze(path: Path) -> None:
    path.with_suffix(".img").write_bytes(_noise().tobytes())
    read_volume(path)


def _dicom(syntax: str) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        side = (40, 36) if syntax in _COMPRESSED else _SHAPE_ZYX[1:]  # large enough for every encoder
        data = image(_noise(side), (1.0, 2.0, 3.0), spacing_mm_yx=(0.5, 0.75), SliceThickness="1", RescaleSlope="2")
        data = compressed(data, syntax) if syntax in _COMPRESSED else data
        return save(data, folder / "sound", syntax).read_bytes()

    return make


def _manifest(folder: Path) -> bytes:
    transfer = function((0.0, (1.0, 0.0, 0.0), 0.0), (200.0, (1.0, 1.0, 1.0), 2.0))
    return (tiny_package(folder / "sound.volpkg", _noise().astype(np.uint8), transfer).path / MANIFEST).read_bytes()


def _single_file(folder: Path) -> bytes:
    transfer = function((0.0, (1.0, 0.0, 0.0), 0.0), (200.0, (1.0, 1.0, 1.0), 2.0))
    package = tiny_package(folder / "sound.volpkg", _noise().astype(np.uint8), transfer).path
    file = io.BytesIO()
    write_single_file(package, names_in(package), file, Silent())
    return file.getvalue()


def _read_single_file(path: Path) -> None:
    package = Package.open(path, allow_draft=True)
    for record in package.manifest.files:
        assert hashlib.sha256(package.read_bytes(record.path)).hexdigest() == record.sha256


def _read_manifest(path: Path) -> None:
    manifest = decode_manifest(path.read_bytes(), path)
    assert decode_manifest(encode_manifest(manifest), path) == manifest


def _ktx2(_folder: Path) -> bytes:
    texels = _noise().astype(np.uint8)
    return b"".join(ktx2.encode(ktx2.Ktx2Image("r8unorm", _SHAPE_ZYX, texels, 3)))


def _supercompressed(_folder: Path) -> bytes:
    texels = (np.arange(24 * 30 * 28) // 9 % 251).reshape(24, 30, 28).astype(np.uint8)
    plain = b"".join(ktx2.encode(ktx2.Ktx2Image("r8unorm", texels.shape, texels, 3)))
    return ktx2.supercompressed(plain, "texture")


def _read_ktx2(path: Path) -> None:
    texture = ktx2.decode(path.read_bytes(), path.name)
    assert texture.data.shape[:3] == texture.shape_zyx
    assert texture.data.size > 0


def _pictures(suffix: str, kind: str, pages: int = 1) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        file = str(folder / f"sound{suffix}")
        values = _noise((pages, 9, 7, 1)) % 250
        output = OpenImageIO.ImageOutput.create(file)
        for z, page in enumerate(values):
            assert output.open(file, OpenImageIO.ImageSpec(7, 9, 1, kind), "AppendSubimage" if z else "Create")
            assert output.write_image(page.astype({"half": "float32"}.get(kind, kind)))
        output.close()
        return Path(file).read_bytes()

    return make


def _ome_tiff(*, packed: bool) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        file = folder / "sound.ome.tif"
        told = {"axes": "CZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.5, "PhysicalSizeZ": 2.0}
        told["Channel"] = {"Name": ["one", "two"]}
        compression = "zlib" if packed else None
        tifffile.imwrite(
            file, _noise((2, *_SHAPE_ZYX)), ome=True, photometric="minisblack", compression=compression, metadata=told
        )
        return file.read_bytes()

    return make


def _read_first_channel(path: Path) -> None:
    read_volume(path, format="ome-tiff", channel=1)


def _read_mosaic(path: Path) -> None:
    read_volume(path, mosaic=TileLayout(tiles_x=2, tiles_y=3, slices=5))


_BETWEEN = b"\0|\0"
_PACKAGE_PARTS = (MANIFEST, "volume-scan-0.ktx2")


def _package(folder: Path) -> bytes:
    transfer = function((0.0, (1.0, 0.0, 0.0), 0.0), (200.0, (1.0, 1.0, 1.0), 2.0))
    package = folder / "sound.volpkg"
    tiny_package(package, _noise().astype(np.uint8), transfer)
    told = lossless(2.0)
    manifest = decode_manifest((package / MANIFEST).read_bytes(), package)
    (channel,) = manifest.channels
    manifest = manifest.model_copy(update={"channels": (channel.model_copy(update={"quantization": told}),)})
    (package / MANIFEST).write_bytes(encode_manifest(manifest))
    return _BETWEEN.join((package / name).read_bytes() for name in _PACKAGE_PARTS)


def _read_package(path: Path) -> None:
    """Read a package of which all but manifest and texture are missing, which a source does not need."""
    folder = path.with_suffix("")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, part in zip(_PACKAGE_PARTS, path.read_bytes().split(_BETWEEN, 1), strict=False):
        (folder / name).write_bytes(part)
    read_volume(folder, format="volpkg")


_ZARR_PARTS = ("zarr.json", "0/zarr.json", "0/c/0/0/0/0", "0/c/0/1/0/0")


def _zarr_store(folder: Path) -> Path:
    told = multiscales("czyx", scale=(1.0, 2.0, 0.5, 0.5))
    return write_store(
        folder / "sound.zarr", [_noise((2, *_SHAPE_ZYX))], told, chunks=(1, 2, 5, 4), labels=("one", "two")
    )


def _zarr_zip(folder: Path) -> bytes:
    return zipped(_zarr_store(folder), folder / "sound.zip").read_bytes()


def _zarr_parts(folder: Path) -> bytes:
    store = _zarr_store(folder)
    return _BETWEEN.join((store / name).read_bytes() for name in _ZARR_PARTS)


def _zip_of_parts(data: bytes) -> bytes:
    """A store whose metadata and first chunk are damaged, but not the zip around them, whose checksums would tell."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as output:
        for name, part in zip(_ZARR_PARTS, data.split(_BETWEEN, len(_ZARR_PARTS) - 1), strict=False):
            output.writestr(zipfile.ZipInfo(name), part)
    return stream.getvalue()


@cache
def _zarr_files() -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        store = _zarr_store(Path(folder))
        files = sorted(file for file in store.rglob("*") if file.is_file())
        return {file.relative_to(store).as_posix(): file.read_bytes() for file in files}


def _zarr_names(_folder: Path) -> bytes:
    """Names of the files of a store, of which damage loses some: mostly chunks."""
    return "\n".join(_zarr_files()).encode()


def _zip_of_names(names: bytes) -> bytes:
    """A store of those files whose names are still right."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as output:
        for name in sorted(_zarr_files().keys() & {*names.decode("utf-8", "replace").split("\n")}):
            output.writestr(zipfile.ZipInfo(name), _zarr_files()[name])
    return stream.getvalue()


def _read_first_zarr_channel(path: Path) -> None:
    read_volume(path, format="ome-zarr", channel=1)


_VDB_MATRIX = [[0.0, -2.0, 0.0, 5.0], [1.5, 0.0, 0.0, 6.0], [0.0, 0.0, 3.0, 7.0], [0.0, 0.0, 0.0, 1.0]]


def _vdb(folder: Path) -> bytes:
    vdb = import_module("volprep_formats._vdb")
    fog = vdb.FogVolume("density", _VDB_MATRIX)
    fog.add(0, _noise().astype(np.float32))
    file = folder / "sound.vdb"
    fog.write(str(file))
    data = bytearray(file.read_bytes())
    data[21:57] = b"00000000-0000-0000-0000-000000000000"
    return bytes(data)


_SCAN = Grid.of((6, 16, 16), (2.0, 0.5, 0.25), (0.0, 0.0, 0.0))


def read_segmentation(path: Path) -> None:
    """Read a segmentation, bring it onto the grid of a scan, and hold it against its description."""
    found = open_segmentation(path, Silent())
    assert found.segments
    grid = _SCAN
    if isinstance(found, Contours):
        assert len(found.rings) == len(found.segments)
        assert all(np.isfinite(ring).all() for rings in found.rings for ring in rings)
    else:
        assert found.labels.shape == found.grid.shape_zyx
        assert found.labels.max() < len(found.members)
        grid = found.grid
    fitted = fitted_segments(path, grid, ScanFrame(), Silent())
    record = found_segments(fitted, "0" * 64)
    assert sum(record.voxels) == np.prod(grid.shape_zyx)
    assert len(record.segments) == len(found.segments)


_MASK = (_noise() % 2).astype(np.uint8)


def _segmentation(folder: Path) -> bytes:
    frames = [(1 + z % 2, (0, 0, 2.0 * z), plane) for z, plane in enumerate(_MASK)]
    return seg(folder / "sound.dcm", frames).read_bytes()


def _structures(folder: Path) -> bytes:
    ring = [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    return structure_set(folder / "sound.dcm", [[ring, ring], [ring]]).read_bytes()


def _slicer_segmentation(folder: Path) -> bytes:
    fields = ["Segment0_Layer:=0", "Segment0_LabelValue:=1", "Segment1_Layer:=1", "Segment1_LabelValue:=1"]
    return seg_nrrd(folder / "sound.seg.nrrd", np.stack([_MASK, 1 - _MASK]), fields).read_bytes()


def _label_volume(folder: Path) -> bytes:
    file = folder / "sound.nii"
    picture = nibabel.Nifti1Image(_noise().T % 5, np.diag([0.25, 0.5, 2.0, 1.0]))
    nibabel.save(picture, file)
    return file.read_bytes()


VDB = Subject("OpenVDB", ".vdb", _vdb, read_volume)
"""Apart from the others, because not every build reads it."""

SUBJECTS = (
    Subject("raw, gzipped", ".raw.gz", _raw, _read_raw),
    Subject("NumPy in colour", ".npy", colour_subjects.npy_in_colour, _read_colours, cases=300),
    Subject("NRRD in colour", ".nrrd", colour_subjects.nrrd_in_colour, _read_colours, cases=300),
    Subject("VTI in colour", ".vti", colour_subjects.vti_in_colour, _read_colours, cases=300),
    *(
        Subject(f"DICOM in colour, {name}", "", colour_subjects.dicom_in_colour(syntax), _read_colours, cases=300)
        for name, syntax in colour_subjects.DICOM.items()
    ),
    Subject("NIfTI-1", ".nii", _nifti(".nii", "int16", nibabel.Nifti1Image), read_volume),
    Subject("NIfTI-2 of wide integers", ".nii", _nifti(".nii", "int32", nibabel.Nifti2Image), read_volume),
    Subject("NIfTI-1 of floats, gzipped", ".nii.gz", _nifti(".nii.gz", "float32", nibabel.Nifti1Image), read_volume),
    Subject("NIfTI-1 within gzip", ".nii.gz", _nifti(".nii", "float64", nibabel.Nifti1Image), read_volume, _zip),
    Subject("DICOM explicit", "", _dicom(ExplicitVRLittleEndian), read_volume),
    Subject("DICOM implicit", "", _dicom(ImplicitVRLittleEndian), read_volume),
    Subject("DICOM big endian", "", _dicom(ExplicitVRBigEndian), read_volume),
    Subject("DICOM deflated", "", _dicom(DeflatedExplicitVRLittleEndian), read_volume),
    Subject("DICOM RLE", "", _dicom(RLELossless), read_volume),
    Subject("DICOM JPEG-LS", "", _dicom(JPEGLSLossless), read_volume),
    Subject("DICOM JPEG 2000", "", _dicom(JPEG2000Lossless), read_volume),
    Subject("PNG", ".png", _pictures(".png", "uint8"), read_volume),
    Subject("TIFF", ".tif", _pictures(".tif", "uint16", 3), read_volume),
    Subject("OME-TIFF", ".ome.tif", _ome_tiff(packed=False), _read_first_channel),
    Subject("OME-TIFF deflated", ".ome.tif", _ome_tiff(packed=True), _read_first_channel),
    Subject("OME-Zarr", ".zarr.zip", _zarr_zip, _read_first_zarr_channel),
    Subject("OME-Zarr within zip", ".zarr.zip", _zarr_parts, _read_first_zarr_channel, _zip_of_parts),
    Subject("OME-Zarr, chunks missing", ".zarr.zip", _zarr_names, _read_first_zarr_channel, _zip_of_names),
    Subject("OpenEXR", ".exr", _pictures(".exr", "half"), read_volume),
    Subject("FreeSurfer", ".mgh", _mgh, read_volume),
    Subject("FreeSurfer within gzip", ".mgz", _mgh, read_volume, _zip),
    Subject("NumPy", ".npy", _npy, read_volume),
    Subject("NumPy archive", ".npz", _npz, read_volume),
    Subject("NumPy within zip", ".npz", _npy, read_volume, _zip_of_array),
    Subject("MRC", ".mrc", _mrc, read_volume),
    Subject("MRtrix", ".mif", _mrtrix, read_volume),
    Subject("MINC 1", ".mnc", _minc(minc1), read_volume, cases=300),
    Subject("MINC 2", ".mnc", _minc(minc2), read_volume, cases=300),
    Subject("Analyze header", ".hdr", _analyze, _read_analyze),
    Subject("NRRD", ".nrrd", nrrd_file(_noise(), "raw"), read_volume),
    Subject("MetaImage", ".mha", metaimage_file(_noise(), packed=False), read_volume),
    Subject("VTK XML", ".vti", vtk_file(_noise(), ".vti", "inline zlib"), read_volume),
    Subject("VTK legacy", ".vtk", vtk_file(_noise(), ".vtk", "binary"), read_volume),
    Subject("DICOM segmentation", ".dcm", _segmentation, read_segmentation, cases=300),
    Subject("DICOM structure set", ".dcm", _structures, read_segmentation, cases=300),
    Subject("segmentation of Slicer", ".seg.nrrd", _slicer_segmentation, read_segmentation, cases=300),
    Subject("volume of labels", ".nii", _label_volume, read_segmentation, cases=300),
    Subject("mosaic", ".png", _pictures(".png", "uint8"), _read_mosaic),
    Subject("package as a source", ".volpkg.parts", _package, _read_package),
    Subject("package in one file", ".volpkg.zip", _single_file, _read_single_file),
    Subject("manifest", ".json", _manifest, _read_manifest),
    Subject("KTX 2", ".ktx2", _ktx2, _read_ktx2),
    Subject("KTX 2 of Zstandard frames", ".ktx2", _supercompressed, _read_ktx2),
    Subject("glTF mesh", ".glb", glb_file(draco=False), read_mesh),
    Subject("glTF mesh by Draco", ".glb", glb_file(draco=True), read_mesh),
)
"""All kinds."""


def sound_file(subject: Subject) -> bytes:
    """The small sound file of a kind."""
    with TemporaryDirectory() as folder:
        return subject.make(Path(folder))

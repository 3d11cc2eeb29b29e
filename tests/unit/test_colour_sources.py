"""Formats whose voxels have colours: the same light and extinction as pages of a TIFF file, and what is refused."""

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import imagecodecs
import nrrd
import numpy as np
import pytest
import SimpleITK as sitk
import vtk
from colour_scene import ball, write_pictures
from dicom_files import compressed, image, save_all
from pydicom.uid import ExplicitVRLittleEndian, JPEG2000Lossless, JPEGLSLossless, RLELossless
from vdb_files import TILE, HandGrid, write_vdb_by_hand
from vtk.util.numpy_support import numpy_to_vtk
from zarr_stores import multiscales, write_store

from volprep.scan.colour_parts import opened_colours
from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import ColourChannel, SourceInfo, SourceSpec

PARTS = ("red", "green", "blue", "opacity")
SPACING_XYZ = (0.75, 1.0, 1.5)
Pixels = np.ndarray
Write = Callable[[Path, Pixels], Path]


def colours(path: Path, opacity_of: str = "luminance", **more: Any) -> tuple[np.ndarray, SourceInfo]:
    """The four channels [z, y, x, channel] of a source."""
    channels = []
    for part in PARTS:
        wanted = ColourChannel(part=part, opacity_of=opacity_of, shares=((0.0, 0.0), (1.0, 1.0)))
        with open_source(SourceSpec(path=str(path), colour=wanted, **more), Path(), Silent()) as source:
            channels.append(source.read_slab(0, source.info.grid.shape_zyx[0]))
    return np.stack(channels, axis=-1), source.info


@pytest.fixture(scope="module", autouse=True)
def started_workers() -> Iterator[None]:
    """Start worker processes once for all tests: to start them takes longer than to read."""
    with workers():
        yield


def refusal(path: Path, opacity_of: str = "luminance", **more: Any) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        colours(path, opacity_of, **more)
    return error.value


def itk_image(pixels: Pixels) -> sitk.Image:
    written = sitk.GetImageFromArray(pixels, isVector=True)
    written.SetSpacing(SPACING_XYZ)
    return written


def nrrd_by_pynrrd(path: Path, pixels: Pixels) -> Path:
    kind = {3: "RGB-color", 4: "RGBA-color"}[pixels.shape[-1]]
    directions = np.array([[np.nan] * 3, *np.diag(SPACING_XYZ)])
    told = {"space": "left-posterior-superior", "space directions": directions, "space origin": [0.0] * 3}
    told |= {"kinds": [kind, "domain", "domain", "domain"], "encoding": "gzip"}
    nrrd.write(str(path / "v.nrrd"), pixels, told, index_order="C")
    return path / "v.nrrd"


def by_itk(name: str) -> Write:
    def write(folder: Path, pixels: Pixels) -> Path:
        sitk.WriteImage(itk_image(pixels), str(folder / name), useCompression=name.endswith("mha"))
        return folder / name

    return write


def vti(mode: str) -> Write:
    def write(folder: Path, pixels: Pixels) -> Path:
        picture = vtk.vtkImageData()
        picture.SetDimensions(*pixels.shape[2::-1])
        picture.SetSpacing(*SPACING_XYZ)
        scalars = numpy_to_vtk(pixels.reshape(-1, pixels.shape[-1]), deep=True)
        scalars.SetName("colours")
        picture.GetPointData().SetScalars(scalars)
        is_legacy = mode.startswith("legacy")
        writer = vtk.vtkStructuredPointsWriter() if is_legacy else vtk.vtkXMLImageDataWriter()
        file = folder / ("v.vtk" if is_legacy else "v.vti")
        writer.SetFileName(str(file))
        writer.SetInputData(picture)
        if mode == "legacy":
            writer.SetFileTypeToBinary()
        elif not is_legacy:
            {"ascii": writer.SetDataModeToAscii, "appended": writer.SetDataModeToAppended}[mode]()
        assert writer.Write() == 1
        return file

    return write


def pages(folder: Path, pixels: Pixels) -> Path:
    write_pictures(folder / "pages.tif", pixels)
    return folder / "pages.tif"


def npy(folder: Path, pixels: Pixels) -> Path:
    np.save(folder / "v.npy", pixels)
    return folder / "v.npy"


def zarr(axes: str, omero: tuple[str, ...] = ()) -> Write:
    def write(folder: Path, pixels: Pixels) -> Path:
        order = tuple("zyxc".index(axis) for axis in axes)
        values = pixels.transpose(order)
        chunks = tuple(4 if axis != "c" else values.shape[axes.index("c")] for axis in axes)
        store = write_store(folder / "v.zarr", [values], multiscales(axes), chunks=chunks)
        if omero:
            import zarr as library

            group = library.open_group(str(store))
            channels = [{"color": colour, "label": "c"} for colour in omero]
            group.attrs["ome"] = {**group.attrs["ome"], "omero": {"channels": channels}}
        return store

    return write


WRITERS: dict[str, Write] = {
    "NRRD": nrrd_by_pynrrd,
    "NRRD of ITK": by_itk("i.nrrd"),
    "MetaImage": by_itk("i.mha"),
    "NIfTI of ITK": by_itk("i.mhd"),
    "VTI, text": vti("ascii"),
    "VTI, appended": vti("appended"),
    "legacy VTK": vti("legacy"),
    "legacy VTK, text": vti("legacy, text"),
    "NumPy": npy,
    "OME-Zarr, c first": zarr("czyx"),
    "OME-Zarr, c last": zarr("zyxc"),
}


@pytest.mark.long(keep=9)
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("name", WRITERS)
def test_each_format_gives_what_pages_of_tiff_give(tmp_path: Path, name: str, dtype: str) -> None:
    pixels = ball()[..., : 3 if dtype == "uint16" else 4]
    factor = {"uint8": np.uint8(1), "uint16": np.uint16(257), "float32": np.float32(1 / 256)}[dtype]
    scaled = pixels.astype(dtype) * factor
    found, _ = colours(WRITERS[name](tmp_path, scaled))
    off = np.abs(found.astype(int) - colours(pages(tmp_path, scaled))[0])
    # VTK writes text with six digits.
    assert off.max() <= (1 if "text" in name and dtype == "float32" else 0)


def test_places_of_voxels_stay(tmp_path: Path) -> None:
    for name in ("NRRD", "MetaImage", "VTI, appended"):
        _, info = colours(WRITERS[name](tmp_path, ball()))
        assert info.grid.spacing_mm_zyx == SPACING_XYZ[::-1]


def test_channels_of_ome_zarr_are_ordered_by_the_colours_that_they_are_shown_in(tmp_path: Path) -> None:
    pixels = ball()[..., :3]
    swapped = zarr("czyx", ("0000FF", "00FF00", "FF0000"))(tmp_path, np.ascontiguousarray(pixels[..., ::-1]))
    assert np.array_equal(colours(swapped)[0], colours(npy(tmp_path, pixels))[0])


def test_channels_of_ome_zarr_in_other_colours_are_refused(tmp_path: Path) -> None:
    store = zarr("czyx", ("00FFFF", "00FF00", "FF0000"))(tmp_path, ball()[..., :3])
    error = refusal(store)
    assert (error.code, "#00ffff, #00ff00, #ff0000" in str(error)) == ("VP1290", True)


def encoded(pixels: Pixels, syntax: str) -> bytes:
    """One picture [y, x, 3] of bytes in a compressed transfer syntax."""
    if syntax == JPEG2000Lossless:
        return bytes(imagecodecs.jpeg2k_encode(pixels, level=0, codecformat="J2K", reversible=True))
    if syntax == JPEGLSLossless:
        return bytes(imagecodecs.jpegls_encode(pixels))
    segments = [bytes(imagecodecs.packbits_encode(pixels[..., k].tobytes())) for k in range(3)]
    segments = [segment + bytes(len(segment) % 2) for segment in segments]
    ends = np.cumsum([64, *(len(segment) for segment in segments)])
    return struct.pack("<16L", 3, *ends[:3], *[0] * 12) + b"".join(segments)


def dicom(pixels: Pixels, **attributes: Any) -> list[Any]:
    """Images of RGB, 2 mm apart."""
    told = {"SamplesPerPixel": 3, "PhotometricInterpretation": "RGB", "PlanarConfiguration": 0, "SliceThickness": 2}
    told |= attributes
    images = []
    for z, values in enumerate(pixels):
        data = image(values[..., 0], (0.0, 0.0, 2.0 * z), **told)
        data.PixelData = values.tobytes() + b"\0" * (values.nbytes % 2)
        images.append(data)
    return images


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, RLELossless, JPEG2000Lossless, JPEGLSLossless])
def test_dicom_in_colour_gives_what_pages_of_tiff_give(tmp_path: Path, syntax: str) -> None:
    pixels = ball()[:4, :, :, :3].copy()
    images = dicom(pixels)
    if syntax != ExplicitVRLittleEndian:
        images = [
            compressed(data, syntax, encoded(values, syntax)) for data, values in zip(images, pixels, strict=True)
        ]
    save_all(images, tmp_path / "series", syntax)
    found, info = colours(tmp_path / "series")
    assert np.array_equal(found, colours(pages(tmp_path, pixels))[0])
    assert info.grid.spacing_mm_zyx[0] == 2.0


def test_a_series_in_colour_is_chosen_beside_a_grey_one(tmp_path: Path) -> None:
    pixels = ball()[:4, :, :, :3].copy()
    save_all(dicom(pixels, SeriesInstanceUID="1.2.3"), tmp_path / "colour")
    save_all([image(values[..., 0], (0.0, 0.0, 2.0 * z)) for z, values in enumerate(pixels)], tmp_path / "grey")
    found, _ = colours(tmp_path)
    assert np.array_equal(found, colours(npy(tmp_path, pixels))[0])


def test_planes_and_shared_differences_of_dicom(tmp_path: Path) -> None:
    from pydicom.pixels.processing import convert_color_space

    pixels = ball()[:1, :, :16, :3].copy()
    planes = dicom(pixels, PlanarConfiguration=1)
    planes[0].PixelData = np.moveaxis(pixels[0], -1, 0).tobytes()
    save_all(planes, tmp_path / "planes")
    assert np.array_equal(colours(tmp_path / "planes")[0], colours(npy(tmp_path, pixels))[0])
    ybr = convert_color_space(pixels[0], "RGB", "YBR_FULL")
    ybr[:, 1::2, 1:] = ybr[:, ::2, 1:]
    pairs = dicom(pixels, PhotometricInterpretation="YBR_FULL_422")
    packed = np.stack([ybr[:, ::2, 0], ybr[:, 1::2, 0], ybr[:, ::2, 1], ybr[:, ::2, 2]], axis=-1)
    pairs[0].PixelData = packed.tobytes()
    save_all(pairs, tmp_path / "pairs")
    expected = convert_color_space(ybr, "YBR_FULL", "RGB")[None]
    assert np.array_equal(colours(tmp_path / "pairs")[0], colours(npy(tmp_path, expected))[0])


def test_sample_files_of_pydicom_have_the_colours_that_pydicom_and_itk_read(tmp_path: Path) -> None:
    from pydicom import dcmread
    from pydicom.data import get_testdata_file
    from pydicom.pixels import pixel_array

    names = ("SC_rgb_rle_16bit", "SC_rgb_dcmtk_+eb+cy+np", "SC_rgb_jpeg_app14_dcmd", "SC_ybr_full_422_uncompressed")
    for name in names:
        file = get_testdata_file(f"{name}.dcm", download=False)
        if file is None:
            continue
        data = dcmread(file)
        data.ImagePositionPatient, data.PixelSpacing = [0, 0, 0], [1, 1]
        data.ImageOrientationPatient, data.SliceThickness = [1, 0, 0, 0, 1, 0], 1
        (tmp_path / name).mkdir()
        data.save_as(tmp_path / name / "one.dcm")
        expected = pixel_array(file, raw=False)[None]
        assert np.array_equal(colours(tmp_path / name)[0], colours(npy(tmp_path, expected))[0])


BAD: dict[str, tuple[Write, Pixels, str, str]] = {
    "one component": (by_itk("i.mha"), ball()[..., :1], "luminance", "1 component"),
    "two components": (vti("appended"), ball()[..., :2].copy(), "luminance", "2 component"),
    "signed": (by_itk("i.mha"), ball()[..., :3].astype(np.int16), "luminance", "int16"),
    "wide": (npy, ball()[..., :3].astype(np.uint32), "luminance", "uint32"),
    "no alpha": (nrrd_by_pynrrd, ball()[..., :3], "alpha", "no alpha"),
    "too bright": (vti("appended"), ball()[..., :3].astype(np.float32), "luminance", "outside of 0 to 1"),
    "three axes": (npy, ball()[..., 0], "luminance", "3 axes"),
    "five channels": (zarr("czyx"), np.zeros((4, 4, 4, 5), np.uint8), "luminance", "5 component"),
}


@pytest.mark.parametrize("name", BAD)
def test_voxels_that_are_no_colours_are_refused(tmp_path: Path, name: str) -> None:
    write, pixels, opacity_of, said = BAD[name]
    error = refusal(write(tmp_path, pixels), opacity_of)
    assert (error.code, said in str(error)) == ("VP1290", True)


def test_colours_along_a_slow_axis_of_nrrd_and_other_spaces_of_colour_are_refused(tmp_path: Path) -> None:
    for kinds in ("domain domain domain rgb-color", "hsv-color domain domain domain"):
        sizes = "3 2 2 2" if kinds.startswith("hsv") else "2 2 2 3"
        lines = ["NRRD0004", "type: uint8", "dimension: 4", f"sizes: {sizes}", f"kinds: {kinds}", "encoding: raw"]
        (tmp_path / "v.nrrd").write_bytes("\n".join([*lines, "", ""]).encode() + bytes(24))
        error = refusal(tmp_path / "v.nrrd")
        assert (error.code, "fastest axis" in str(error)) == ("VP1290", True)


def test_one_of_several_volumes_of_numbers_has_no_colours(tmp_path: Path) -> None:
    lines = ["NDims = 4", "DimSize = 2 2 2 2", "ElementType = MET_UCHAR", "ElementDataFile = LOCAL", ""]
    (tmp_path / "v.mha").write_bytes("\n".join(lines).encode() + bytes(16))
    error = refusal(tmp_path / "v.mha", volume=1)
    assert (error.code, "numbers of type uint8" in str(error)) == ("VP1290", True)


def test_dicom_without_colours_that_are_read_is_refused(tmp_path: Path) -> None:
    pixels = ball()[:4, :, :, :3].copy()
    save_all([image(values[..., 0], (0.0, 0.0, 2.0 * z)) for z, values in enumerate(pixels)], tmp_path / "grey")
    save_all(dicom(pixels, PhotometricInterpretation="YBR_PARTIAL_420"), tmp_path / "partial")
    save_all(dicom(pixels, RescaleSlope=2, RescaleIntercept=0), tmp_path / "rescaled")
    for name, said in (("grey", "are grey"), ("partial", "YBR_PARTIAL_420"), ("rescaled", "rescaled")):
        error = refusal(tmp_path / name)
        assert (error.code, said in str(error)) == ("VP1290", True)


def test_pictures_are_decoded_once_for_all_channels(tmp_path: Path) -> None:
    expected, _ = colours(pages(tmp_path, ball()))
    wanted = ColourChannel(part="red", opacity_of="luminance", shares=((0.0, 0.0), (1.0, 1.0)))
    depth = len(expected)
    spec = SourceSpec(path=str(tmp_path / "pages.tif"), colour=wanted)
    with opened_colours(spec, tmp_path, Silent()) as channels:
        found = [np.concatenate([channels[0].read_slab(z, min(z + 4, depth)) for z in range(0, depth, 4)])]
        (tmp_path / "pages.tif").unlink()
        found += [np.concatenate([each.read_slab(0, 2), each.read_slab(2, depth)]) for each in channels[1:]]
    assert np.array_equal(np.stack(found, axis=-1), expected)
    assert list(tmp_path.iterdir()) == []


def test_vectors_of_openvdb_are_linear_light(tmp_path: Path) -> None:
    tiles = {(1, 0, 0): (0.25, 0.5, 1.0), (0, 0, 0): (1.0, 0.0, 0.125)}
    density = HandGrid({(0, 0, 0): 1.0})
    write_vdb_by_hand(tmp_path / "v.vdb", density, HandGrid(tiles, name="Cd", kind="vec3s"))
    expected = np.zeros((TILE, TILE, 2 * TILE, 3), np.float32)
    for (i, _, k), colour in tiles.items():
        expected[k * TILE : (k + 1) * TILE, :, i * TILE : (i + 1) * TILE] = colour
    wanted = ColourChannel(part="all", opacity_of="red", shares=((0.0, 0.0), (1.0, 1.0)))
    corners = (slice(None, None, 51), slice(None, None, 63), slice(None, None, 51))
    values = []
    for path in (tmp_path / "v.vdb", npy(tmp_path, expected[corners])):
        with open_source(SourceSpec(path=str(path), colour=wanted), Path(), Silent()) as source:
            values.append(source.read_slab(0, source.info.grid.shape_zyx[0]))
    assert np.array_equal(values[0][corners], values[1])


def test_grids_of_openvdb_that_are_no_colours_are_refused(tmp_path: Path) -> None:
    write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 1.0}))
    assert refusal(tmp_path / "v.vdb").code == "VP1202"
    write_vdb_by_hand(tmp_path / "b.vdb", HandGrid({(0, 0, 0): (2.0, 0.0, 0.0)}, kind="vec3s"))
    assert (refusal(tmp_path / "b.vdb").code, refusal(tmp_path / "b.vdb", "alpha").code) == ("VP1290", "VP1290")

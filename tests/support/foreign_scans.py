"""Small scans in foreign formats, written with foreign libraries, and a scene for each: what mutants are tried on."""

from collections.abc import Callable
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pydicom
import tifffile
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, generate_uid
from segment_files import seg, seg_nrrd, structure_set
from two_grids import write_two_grids

SHAPE_ZYX = (22, 27, 31)
PICTURE_SIZE = 64


def blobs(seed: int = 3) -> np.ndarray:
    """Values from about 0 to 1: smooth hills with no symmetry, one dense, one thin, in empty air."""
    rng = np.random.default_rng(seed)
    z, y, x = (np.arange(n) / (n - 1) for n in SHAPE_ZYX)
    z, y, x = np.meshgrid(z, y, x, indexing="ij")

    def hill(centre, width):
        return np.exp(-sum(((each - c) / w) ** 2 for each, c, w in zip((z, y, x), centre, width, strict=True)))

    values = 0.9 * hill((0.45, 0.4, 0.6), (0.16, 0.2, 0.22)) + 0.6 * hill((0.7, 0.7, 0.25), (0.12, 0.1, 0.12))
    values += 0.5 * hill((0.3, 0.75, 0.7), (0.3, 0.05, 0.06))
    return np.clip(values + 0.01 * rng.standard_normal(values.shape) * (values > 0.05), 0.0, 1.0)


POINTS = """
reference_mm = 4.0
points = [
    { value = 60.0, colour = "#6b4032", opacity = 0.0 },
    { value = 200.0, colour = "#c08a6a", opacity = 0.35 },
    { value = 520.0, colour = [0.9, 0.8, 0.2], opacity = 0.6 },
    { value = 800.0, colour = "#fff6ea", opacity = 0.995 },
]
"""


def _scene(folder: Path, name: str, source: str, more: str = "", points: str = POINTS) -> Path:
    path = folder / f"{name}.toml"
    text = f'name = "{name}"\n{more}\n[source]\n{source}\n[[transfer]]\nname = "tissue"\n{points}'
    path.write_text(text, encoding="utf-8")
    return path


_RENDER = f"[render]\npicture_size = {PICTURE_SIZE}\n"
_LEVELS = "[pyramid]\ncoarsest_longest_axis = 9\n"


def nifti(folder: Path) -> Path:
    """Emission and absorption of a NIfTI file, stored with slope and intercept, in three levels."""
    stored = np.rint(blobs() * 2000 + 40).astype(np.int16)
    image = nibabel.Nifti1Image(stored.T, np.array([[-0.8, 0, 0, 12], [0, 1.1, 0, -9], [0, 0, 1.7, 4], [0, 0, 0, 1]]))
    image.header.set_slope_inter(0.5, -20.0)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, folder / "scan.nii.gz")
    return _scene(folder, "nifti", 'path = "scan.nii.gz"', _RENDER + _LEVELS + 'filter = "box"\n')


def dicom(folder: Path) -> Path:
    """A lit CT series, oblique, with an intercept, in files whose names have another order."""
    stored = np.rint(blobs(4) * 1000 + 24).astype(np.uint16)
    series = folder / "series"
    series.mkdir()
    along_row, along_column = np.array([0.8, 0.6, 0.0]), np.array([0.0, 0.0, -1.0])
    normal = np.cross(along_row, along_column)
    uids = [generate_uid(entropy_srcs=[f"mutants {part}"]) for part in ("series", "study", "frame")]
    for number, slice_yx in enumerate(stored):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = pydicom.uid.CTImageStorage
        meta.MediaStorageSOPInstanceUID = generate_uid(entropy_srcs=[f"mutants slice {number}"])
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        file = FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
        file.SOPClassUID, file.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        file.SeriesInstanceUID, file.StudyInstanceUID, file.FrameOfReferenceUID = uids
        file.Modality, file.SamplesPerPixel, file.PhotometricInterpretation = "CT", 1, "MONOCHROME2"
        file.Rows, file.Columns = slice_yx.shape
        file.BitsAllocated, file.BitsStored, file.HighBit, file.PixelRepresentation = 16, 16, 15, 0
        file.PixelSpacing, file.SliceThickness, file.InstanceNumber = [1.2, 0.7], 3.0, number + 1
        file.ImageOrientationPatient = [*along_row, *along_column]
        file.ImagePositionPatient = list(np.array([5.0, -20.0, 40.0]) + 2.0 * number * normal)
        file.RescaleSlope, file.RescaleIntercept = 1, -124
        file.PixelData = slice_yx.tobytes()
        file.save_as(series / f"{number * 7 % 22:02d}.dcm", enforce_file_format=True)
    lit = _RENDER + 'lighting = "headlight"\n' + _LEVELS + 'filter = "box"\n'
    return _scene(folder, "dicom", 'path = "series"', lit)


def maximum(folder: Path) -> Path:
    """A maximum of an NRRD file, whose axes point right, front and head, in perspective, in levels."""
    stored = np.rint(blobs(5) * 1000).astype(np.uint16)
    header = {
        "space": "right-anterior-superior",
        "space directions": np.diag([0.9, 1.3, -1.1]),
        "space origin": [3.0, 4.0, 5.0],
    }
    nrrd.write(str(folder / "scan.nrrd"), np.ascontiguousarray(stored.T), header)
    more = _RENDER + 'compositing = "maximum"\nprojection = "perspective"\n' + _LEVELS
    return _scene(folder, "maximum", 'path = "scan.nrrd"', more)


def surface(folder: Path) -> Path:
    """A lit isosurface of raw voxels, from a light with a place."""
    (np.rint(blobs(6) * 1000)).astype(">u2").tofile(folder / "scan.raw")
    layout = f'shape_zyx = {list(SHAPE_ZYX)}, dtype = "uint16", byte_order = "big", spacing_mm_zyx = [1.4, 1.0, 0.8]'
    more = (
        _RENDER
        + 'compositing = "isosurface"\nlighting = "blinn-phong"\n[lighting]\nlight_mm = [40.0, -30.0, 60.0]\n'
        + "[tolerance]\nrmse = 0.05\nmaximum = 1.0\n"
    )
    points = "isovalue = 420.0" + POINTS
    return _scene(folder, "surface", f'path = "scan.raw"\nraw = {{ {layout} }}', more, points)


def opaque(folder: Path) -> Path:
    """Dense matter in a NumPy file: rays end early, and a 2D mosaic of a device without 3D textures."""
    np.save(folder / "scan.npy", np.rint(blobs(7) * 1000).astype(np.uint16))
    points = """
points = [
    { value = 80.0, colour = "#2040ff", extinction_per_mm = 0.0 },
    { value = 150.0, colour = "#2040ff", extinction_per_mm = 0.22 },
    { value = 500.0, colour = "#ffd020", extinction_per_mm = 0.3 },
    { value = 900.0, colour = "#ff2020", extinction_per_mm = 0.5 },
]
"""
    source = 'path = "scan.npy"\narray = { spacing_mm_zyx = [1.0, 1.0, 1.0] }'
    return _scene(folder, "opaque", source, 'profile = "gles2-2048"\n' + _RENDER + "opacity_cutoff = 0.998\n", points)


def mida(folder: Path) -> Path:
    """Maximum intensity difference accumulation, with control points beyond all values."""
    np.save(folder / "scan.npy", np.rint(blobs(8) * 1000).astype(np.uint16))
    points = """
intensities = [0.0, 1000.0]
points = [
    { value = -10.0, colour = "#2040ff", extinction_per_mm = 0.02 },
    { value = 1010.0, colour = "#ffd020", extinction_per_mm = 0.3 },
]
"""
    more = _RENDER + 'compositing = "mida"\n'
    return _scene(folder, "mida", 'path = "scan.npy"\narray = { spacing_mm_zyx = [1.1, 1.0, 0.9] }', more, points)


def minimum(folder: Path) -> Path:
    """A minimum: dark airways in matter."""
    np.save(folder / "scan.npy", np.rint(1000 - blobs(9) * 900).astype(np.uint16))
    points = """
reference_mm = 2.0
points = [
    { value = 100.0, colour = "#ffffff", opacity = 0.95 },
    { value = 700.0, colour = "#4060c0", opacity = 0.4 },
    { value = 950.0, colour = "#101020", opacity = 0.0 },
]
"""
    more = _RENDER + 'compositing = "minimum"\n' + _LEVELS
    return _scene(folder, "minimum", 'path = "scan.npy"\narray = { spacing_mm_zyx = [1.0, 1.2, 0.8] }', more, points)


def vessels(folder: Path) -> Path:
    """A maximum of three thin vessels, and a level of maxima: means lose most of them."""
    places = np.stack(np.meshgrid(*map(np.arange, SHAPE_ZYX), indexing="ij"), axis=-1).astype(float)
    stored = np.zeros(SHAPE_ZYX)
    for middle, direction in (((6, 7, 9), (1, 2, 3)), ((15, 18, 8), (-1, 1, 4)), ((11, 12, 24), (3, -2, 1))):
        along = np.array(direction) / np.linalg.norm(direction)
        aside = places - middle - ((places - middle) @ along)[..., None] * along
        stored = np.maximum(stored, 1000 * np.exp(-(aside**2).sum(axis=-1) / 0.8))
    np.save(folder / "scan.npy", np.rint(stored).astype(np.uint16))
    points = """
reference_mm = 2.0
points = [
    { value = 300.0, colour = "#ff4020", opacity = 0.0 },
    { value = 900.0, colour = "#fff0e0", opacity = 0.9 },
]
"""
    more = _RENDER + 'compositing = "maximum"\n' + '[pyramid]\ncoarsest_longest_axis = 16\nfilter = "maximum"\n'
    return _scene(folder, "vessels", 'path = "scan.npy"\narray = { spacing_mm_zyx = [1.0, 1.0, 1.0] }', more, points)


def segments(folder: Path) -> Path:
    """A lit scan with two segments, which the headlight sees by the borders of the visible extinction."""
    values = blobs(4)
    affine = np.diag([-1.0, -1.0, 1.2, 1.0])
    nibabel.save(nibabel.Nifti1Image(np.rint(values * 900 + 50).astype(np.int16).T, affine), folder / "scan.nii")
    labels = np.where(values > 0.35, 2, np.where(values > 0.1, 1, 0)).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(labels.T, affine), folder / "labels.nii")
    style = '[[segments.style]]\nlabels = [{}]\ntint = "{}"\nopacity = {}\n'
    styles = style.format(1, "#20c0ff", 0.1) + style.format(2, "#ff8040", 1.0)
    more = f'{_RENDER}lighting = "headlight"\n[segments]\nsource = "labels.nii"\noutside_opacity = 0.0\n{styles}'
    points = """
points = [
    { value = 0.0, colour = "#c0c0c0", extinction_per_mm = 0.25 },
    { value = 1000.0, colour = "#ffffff", extinction_per_mm = 0.3 },
]
"""
    return _scene(folder, "segments", 'path = "scan.nii"', more, points)


def styles(folder: Path) -> Path:
    """Three segments of two functions, of which one is hidden and the last comes before the others in the package."""
    values = blobs(4)
    affine = np.diag([-1.0, -1.0, 1.2, 1.0])
    nibabel.save(nibabel.Nifti1Image(np.rint(values * 900 + 50).astype(np.int16).T, affine), folder / "scan.nii")
    labels = np.digitize(values, (0.1, 0.3, 0.5)).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(labels.T, affine), folder / "labels.nii")
    style = '[[segments.style]]\nlabels = [{}]\ntint = "{}"\n{}\n'
    looks = (
        style.format(1, "#20c0ff", "opacity = 0.1")
        + style.format(2, "#ff8040", "visible = false")
        + style.format(3, "#80ff40", 'transfer = "tissue"')
    )
    inside = '[[transfer]]\nname = "inside"\npoints = [{ value = 0.0, colour = "#ffffff", extinction_per_mm = 0.1 }]\n'
    path = _scene(folder, "styles", 'path = "scan.nii"', f'{_RENDER}[segments]\nsource = "labels.nii"\n{looks}')
    path.write_text(path.read_text(encoding="utf-8") + inside, encoding="utf-8")
    return path


def _segmented(folder: Path, name: str, source: str) -> Path:
    """Write a scan of voxels as wide as those of segment_files.py, and its scene with segments."""
    affine = np.diag([-0.25, -0.5, 2.0, 1.0])
    nibabel.save(nibabel.Nifti1Image(np.rint(blobs(4) * 900 + 50).astype(np.int16).T, affine), folder / "scan.nii")
    style = '[[segments.style]]\nlabels = [{}]\ntint = "{}"\nopacity = {}\n'
    styles = style.format(1, "#20c0ff", 0.2) + style.format(2, "#ff8040", 1.0)
    return _scene(
        folder, name, 'path = "scan.nii"', f'{_RENDER}[segments]\nsource = "{source}"\noutside_opacity = 0.0\n{styles}'
    )


def dicom_seg(folder: Path) -> Path:
    """A scan with a DICOM segmentation, whose frames have no order."""
    labels = np.digitize(blobs(4), (0.1, 0.35))
    places = [(number, z) for z in np.random.default_rng(4).permutation(len(labels)) for number in (1, 2)]
    frames = [(number, (0.0, 0.0, 2.0 * z), (labels[z] == number).astype(np.uint8)) for number, z in places]
    seg(folder / "segments.dcm", frames)
    return _segmented(folder, "dicom-seg", "segments.dcm")


def contours(folder: Path) -> Path:
    """A scan with a structure set: a tube with a hole, and a ball whose planes lie between the slices."""
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)

    def ring(x: float, y: float, radius: float, z: float) -> np.ndarray:
        return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn), np.full(24, z)])

    z, y, x = ((n - 1) * h / 2 for n, h in zip(blobs(4).shape, (2.0, 0.5, 0.25), strict=True))
    planes = np.arange(4.0, 2 * z - 3.0, 2.0)
    tube = [ring(0.8 * x, y, radius * y, place) for place in planes for radius in (0.5, 0.2)]
    ball = [ring(1.4 * x, 1.1 * y, 0.3 * x, place + 0.4) for place in planes]
    structure_set(folder / "structures.dcm", [tube, ball])
    return _segmented(folder, "contours", "structures.dcm")


def slicer(folder: Path) -> Path:
    """A scan with a segmentation of 3D Slicer in two layers, with labels of its own."""
    labels = np.digitize(blobs(4), (0.1, 0.35))
    layers = np.stack([np.where(labels == 1, 7, 0), np.where(labels == 2, 3, 0)]).astype(np.uint8)
    fields = ["Segment0_Layer:=0", "Segment0_LabelValue:=7", "Segment1_Layer:=1", "Segment1_LabelValue:=3"]
    path = seg_nrrd(folder / "segments.seg.nrrd", layers, fields)
    path.write_bytes(path.read_bytes().replace(b"space origin: (1,2,3)", b"space origin: (0,0,0)"))
    return _segmented(folder, "slicer", path.name)


def _of_array(folder: Path, name: str, seed: int, more: str, points: str = POINTS) -> Path:
    """Write a NumPy file and its scene."""
    np.save(folder / "scan.npy", np.rint(blobs(seed) * 1000).astype(np.uint16))
    source = 'path = "scan.npy"\narray = { spacing_mm_zyx = [1.1, 1.0, 0.9] }'
    return _scene(folder, name, source, _RENDER + more, points)


_WIDE = "[tolerance]\nrmse = 0.02\nflip = 0.1\nkept_light = 0.5\n"
"""Of what is coarser than the default tolerance: normals that are not filtered, and steps of a palette."""


def average(folder: Path) -> Path:
    """The mean of each ray, as in an X-ray picture."""
    return _of_array(folder, "average", 10, 'compositing = "average"\n')


def palette(folder: Path) -> Path:
    """A palette in the shader."""
    return _of_array(folder, "palette", 11, 'classification = "palette"\n' + _WIDE)


def preintegrated(folder: Path) -> Path:
    """Integrals of the transfer function."""
    return _of_array(folder, "preintegrated", 12, 'classification = "preintegrated"\n')


def octahedron(folder: Path) -> Path:
    """A headlight on normals in two bytes."""
    return _of_array(folder, "octahedron", 13, 'lighting = "headlight"\n[normals]\ncode = "oct12"\n' + _WIDE)


def slopes(folder: Path) -> Path:
    """A headlight on slopes that the shader takes."""
    return _of_array(folder, "slopes", 14, 'lighting = "headlight"\n[lighting]\nnormals = "central"\n')


def bricks(folder: Path) -> Path:
    """Bricks, and what is empty left out; some bricks have one value."""
    path = _of_array(folder, "bricks", 15, "[bricks]\nsize = 8\n")
    values = np.load(folder / "scan.npy")
    values[2:20, 4:22, 6:24] = 300
    np.save(folder / "scan.npy", values)
    return path


def soft(folder: Path) -> Path:
    """Light from all around that is computed once."""
    return _of_array(folder, "soft", 16, '[lighting]\nbaked = "occlusion"\n')


def turned(folder: Path) -> Path:
    """The same, for an app that turns it, from a blue sky and an orange ground."""
    lights = "turnable = true\nsky = [0.4, 0.6, 1.2]\nground = [1.0, 0.5, 0.2]\n"
    return _of_array(folder, "turned", 16, f'[lighting]\nbaked = "occlusion"\n{lights}')


def together(folder: Path) -> Path:
    """Two channels in one picture."""
    np.save(folder / "other.npy", np.rint(blobs(17)[::-1] * 1000).astype(np.uint16))
    array = "array = { spacing_mm_zyx = [1.1, 1.0, 0.9] }"
    channels = ", ".join(f'{{ name = "{name}", path = "{name}.npy", {array} }}' for name in ("scan", "other"))
    np.save(folder / "scan.npy", np.rint(blobs(18) * 1000).astype(np.uint16))
    path = _scene(folder, "together", f"channels = [{channels}]", _RENDER)
    second = f'[[transfer]]\nname = "second"\nchannel = "other"\n{POINTS.replace("#c08a6a", "#40c0ff")}[together]\n'
    path.write_text(path.read_text(encoding="utf-8") + second, encoding="utf-8")
    return path


def colour(folder: Path) -> Path:
    """A volume in colour: pages of RGBA."""
    parts = [blobs(19), blobs(20)[:, ::-1], blobs(21)[:, :, ::-1]]
    pixels = np.rint(255 * np.stack([*parts, np.clip(np.sum(parts, axis=0), 0.0, 1.0)], axis=-1)).astype(np.uint8)
    tifffile.imwrite(folder / "pages.tif", pixels, photometric="rgb", extrasamples=["unassalpha"])
    points = "{ value = 0.0, extinction_per_mm = 0.0 }, { value = 1.0, extinction_per_mm = 0.4 }"
    path = folder / "colour.toml"
    path.write_text(
        f'name = "colour"\n{_RENDER}[source]\npath = "pages.tif"\nstack = {{ spacing_mm_zyx = [1.1, 1.0, 0.9] }}\n'
        f"[colour]\npoints = [{points}]\n",
        encoding="utf-8",
    )
    return path


def grids(folder: Path) -> Path:
    """A CT, and uptake on a turned grid that is registered 2 mm away."""
    moved = "transform = [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
    return write_two_grids(folder, pet=moved)


SCENES: dict[str, Callable[[Path], Path]] = {
    each.__name__: each
    for each in (
        *(
            nifti,
            dicom,
            maximum,
            surface,
            opaque,
            mida,
            minimum,
            vessels,
            segments,
            styles,
            dicom_seg,
            slicer,
            contours,
        ),
        *(contours, average, palette, preintegrated, octahedron, slopes, bricks, soft, turned, together, colour, grids),
    )
}

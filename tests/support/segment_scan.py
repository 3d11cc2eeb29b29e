"""A small scan with four segments, as packages and as the oracle draws it."""

from pathlib import Path

import nibabel
import numpy as np
from scene_builds import view_of

from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep.truth.decoded import light_of_scan
from volprep.truth.labelled import Labelled, labelled_picture, tinted
from volprep.truth.volume import Volume
from volprep_formats.package.parts.segments.record import looks
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

SHAPE_XYZ = (21, 17, 13)
AFFINE = np.diag([-1.0, -1.5, 2.0, 1.0])
TINTS = {1: "#ff4020", 2: "#20c0ff", 3: "#40ff40", 200: "#ffffff"}
SOFT = {"value": 0.0, "colour": "#808080", "extinction_per_mm": 0.01}
DENSE = {"value": 255.0, "colour": "#ffffff", "extinction_per_mm": 0.2}
INSIDE = [{"value": 0.0, "colour": "#c0c0c0", "extinction_per_mm": 0.08}, DENSE]

FAINT_STYLES = [{"labels": [1], "opacity": 0.0055}, {"labels": [2], "opacity": 0.02}]
"""Opacities that bytes round too much in matter as dense as this."""
DENSE_INSIDE = [{"name": "inside", "points": [{"value": 0.0, "colour": "#c0c0c0", "extinction_per_mm": 10.0}]}]


def scene_of(folder: Path, coarsest: int = 48, **segments: object) -> Scene:
    table: dict = {
        "name": "body",
        "source": {"path": str(folder / "scan.nii")},
        "transfer": [{"name": "veil", "points": [SOFT, DENSE]}, {"name": "inside", "points": INSIDE}],
        "pyramid": {"coarsest_longest_axis": coarsest},
        "render": {"step_voxels": 0.25, "opacity_cutoff": 1.0, "picture_size": 48},
        "crop": "none",
    }
    if segments:
        styles = [{"labels": [number], "tint": tint} for number, tint in TINTS.items()]
        table["segments"] = {"source": str(folder / "labels.nii"), "style": styles, **segments}
    else:
        del table["transfer"][1]
    return Scene.model_validate(table)


def write_segments(folder: Path) -> Path:
    """Write a scan, its segments, and segments in more than 127 labels."""
    x, y, z = np.indices(SHAPE_XYZ)
    values = 128 + 100 * np.sin(x / 3) * np.cos(y / 4) * np.cos(z / 3)
    labels = np.zeros(SHAPE_XYZ, np.int16)
    labels[3:12, 3:14, 2:11] = 1
    labels[12:19, 3:14, 2:11] = 2
    labels[8:15, 6:12, 4:9] = 3
    labels[2:5, 2:5, 2:5] = 200
    nibabel.save(nibabel.Nifti1Image(values.astype(np.uint8), AFFINE), folder / "scan.nii")
    nibabel.save(nibabel.Nifti1Image(labels, AFFINE), folder / "labels.nii")
    many = np.where(labels > 0, x + 21 * y, 0).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(many, AFFINE), folder / "many.nii")
    joined = np.where(labels == 2, 1, labels)
    nibabel.save(nibabel.Nifti1Image(joined, AFFINE), folder / "joined.nii")
    return folder


def built(
    folder: Path, name: str, profile: str = "gles3", change: dict[str, object] | None = None, **segments: object
) -> Package:
    scene = Scene.model_validate(scene_of(folder, **segments).model_dump(exclude_unset=True) | (change or {}))
    request = Request(scene, load_profile(profile, folder), None)
    build(request, folder / f"{name}.volpkg", Silent())
    return Package.open(folder / f"{name}.volpkg")


def drawn(
    package: Package, view: str = "anterior-left", transfer: str | None = None, target: str = "rgba32f"
) -> np.ndarray:
    with Renderer(package, transfer=transfer, target=target) as renderer:
        grid = renderer.level.grid
        return renderer.render(view_of(grid, view), (48, 48))


def truth(folder: Path, package: Package, view: str = "anterior-left") -> np.ndarray:
    """The oracle on the scan, with labels and looks as the manifest has them."""
    manifest = package.manifest
    segments, grid = manifest.segments, manifest.grid
    functions = {each.name: each for each in manifest.transfer_functions}
    volumes = [nibabel.load(folder / f"{name}.nii").get_fdata() for name in ("scan", "labels")]
    scan, numbers = (np.ascontiguousarray(volume.T) for volume in volumes)
    labels = np.zeros(numbers.shape, np.uint16)
    by_name = {segment.name: segment.number for segment in segments.segments}
    for place, label in enumerate(segments.labels):
        labels[numbers == (by_name[label.segments[0]] if label.segments else 0)] = place
    shown = zip(segments.labels, looks(segments), strict=True)
    every = tuple(tinted(functions[label.transfer], look[:3], look[3]) if look[3] else None for label, look in shown)
    camera = view_of(grid, view)
    labelled, normals = Labelled(labels, every, segments.border), light_of_scan(manifest)
    return labelled_picture(Volume(scan.astype(np.uint8), grid, normals=normals), labelled, camera, (48, 48)).rgba

"""Write the sample packages of formats/samples, their pictures, and samples.json.

A test builds them again and compares; run this when it fails.

    python tools/make_samples.py [NAME ...]

Each scene in formats/samples/scenes is a sample. Their sources are made here: a body with a bone and an organ.
"""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import nibabel
import numpy as np
import tifffile
from scipy.spatial.transform import Rotation

from volprep.pipeline import preview
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep.truth.picture import encoded
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import names_in
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.png import png_bytes
from volprep_formats.progress import Silent

SAMPLES = Path(__file__).parents[1] / "formats" / "samples"
SIDE = 48
"""Width and height of the pictures in pixels."""
_POINT = 17
"""Point in the middle of the grid of 4 × 3 × 3, around which pieces are drawn."""
_SHAPE_ZYX = (16, 20, 24)
_SPACING_MM_ZYX = (1.5, 1.0, 1.0)


def write_sources(folder: Path) -> None:
    """Write the volumes that the scenes read."""
    z, y, x = np.meshgrid(*(np.arange(n) * h for n, h in zip(_SHAPE_ZYX, _SPACING_MM_ZYX, strict=True)), indexing="ij")
    body = _ellipsoid((z, y, x), (11.25, 9.5, 11.5), (10.5, 9.0, 11.0))
    bone = _ellipsoid((z, y, x), (11.25, 13.5, 11.5), (11.0, 2.2, 2.5))
    organ = _ellipsoid((z, y, x), (13.0, 7.0, 15.0), (4.0, 3.2, 4.0))
    codes = np.rint(70 * body + 150 * bone + 40 * organ).astype(np.uint8)
    labels = np.where(bone > 0.5, 1, np.where(organ > 0.5, 2, 0)).astype(np.uint8)
    codes.tofile(folder / "body.raw")
    np.pad(codes, ((0, 0), (0, 0), (0, 20))).tofile(folder / "wide.raw")
    np.rint(230 * organ).astype(np.uint8).tofile(folder / "activity.raw")
    affine = np.diag([-1.0, -1.0, 1.5, 1.0])
    nibabel.save(nibabel.Nifti1Image(codes.T, affine), folder / "body.nii")
    nibabel.save(nibabel.Nifti1Image(labels.T, affine), folder / "labels.nii")
    turn = Rotation.from_euler("xyz", (25.0, -40.0, 15.0), degrees=True).as_matrix()
    oblique = nibabel.affines.from_matvec(turn @ np.diag([1.0, -1.0, 1.5]), (31.0, -17.0, 230.0))
    nibabel.save(nibabel.Nifti1Image(codes[3:13, 4:18, 2:19].T, oblique), folder / "oblique.nii")
    _write_uptake(folder / "uptake.nii")
    # The organ fills with a tracer; the third frame repeats the second one.
    frames = [np.rint(70 * body + 150 * bone + 80 * share * organ).astype(np.uint8).T for share in (0.0, 1.0, 1.0, 0.5)]
    series = nibabel.Nifti1Image(np.stack(frames, axis=-1), affine)
    series.header.set_xyzt_units("mm", "sec")
    series.header["pixdim"][4] = 2.5
    nibabel.save(series, folder / "series.nii")
    rgba = np.stack([0.3 + 0.7 * bone, 0.3 + 0.7 * organ, x / x.max(), 0.3 * body + 0.7 * bone], axis=-1)
    pages = np.rint(255 * np.clip(rgba, 0.0, 1.0)).astype(np.uint8)
    tifffile.imwrite(folder / "slices.tif", pages, photometric="rgb", extrasamples=["unassalpha"])


def _write_uptake(path: Path) -> None:
    """Write the organ and a spot beside the bone on a coarser, turned grid, 3 mm off: the scene moves it back."""
    turn = Rotation.from_euler("xyz", (10.0, -20.0, 35.0), degrees=True).as_matrix()
    index = np.stack(np.meshgrid(*(np.arange(n) for n in (11, 9, 8)), indexing="ij"), axis=-1)
    steps = turn @ np.diag([2.6, 2.2, 3.1])
    # NIfTI's x and y point the other way.
    places = (index - np.array([5.0, 4.0, 3.5])) @ steps.T + (-13.0, -9.0, 12.0)
    x, y, z = -places[..., 0], -places[..., 1], places[..., 2]
    spots = (
        _ellipsoid((z, y, x), (13.0, 7.0, 15.0), (4.5, 3.7, 4.5)),
        _ellipsoid((z, y, x), (6.0, 13.0, 8.0), (3.5,) * 3),
    )
    affine = nibabel.affines.from_matvec(steps, places[0, 0, 0] + (3.0, 0.0, 0.0))
    nibabel.save(nibabel.Nifti1Image(np.rint(230 * spots[0] + 140 * spots[1]).astype(np.uint8), affine), path)


def _ellipsoid(at_mm: tuple[np.ndarray, ...], centre_mm: tuple[float, ...], radii_mm: tuple[float, ...]) -> np.ndarray:
    """An ellipsoid of 1 with a soft border, in 0; all zyx."""
    radius = np.sqrt(sum(((a - c) / r) ** 2 for a, c, r in zip(at_mm, centre_mm, radii_mm, strict=True)))
    return np.clip((1.0 - radius) * 5.0 + 0.5, 0.0, 1.0)


def write_sample(name: str, sources: Path, target: Path) -> list[dict[str, object]]:
    """Build a sample and draw it; return its entries in samples.json."""
    scene = sources / f"{name}.toml"
    scene.write_bytes((SAMPLES / "scenes" / scene.name).read_bytes())
    folder, file = sources / f"{name}.volpkg", target / f"{name}.volpkg.zip"
    with patch.object(preview, "_SIZE", SIDE):
        build(load_request(scene), folder, Silent())
    with file.open("wb") as stream:
        write_single_file(folder, names_in(folder), stream, Silent())
    package = Package.open(file)
    entries = [_drawn(package, file, target / f"{name}.png", None)]
    if package.manifest.frames:
        last = len(package.manifest.frames) - 1
        entry = _drawn(package.at_frame(last), file, target / f"{name}-last.png", None)
        entries.append({**entry, "frame": last})
    if package.manifest.subvolumes is not None:
        entries.append(_drawn(package, file, target / f"{name}-point.png", _POINT))
    return entries


def _drawn(package: Package, file: Path, picture: Path, point: int | None) -> dict[str, object]:
    """Draw the default picture: its finest level, or the pieces around a point."""
    grid, render = package.manifest.pictures[0].grid or package.manifest.grid, package.manifest.render
    camera = standard_views(grid, render.projection)["anterior-left"]
    # Targets of 8 bits would round dark parts of linear pictures; slices are blended into their target.
    shaders = package.manifest.profile.has_shaders
    with Renderer(package, target="rgba32f", point=point) if shaders else SliceRenderer(package) as renderer:
        pixels = renderer.render(camera.box_from_clip(grid, 1.0), (SIDE, SIDE))
    picture.write_bytes(png_bytes(encoded(pixels, "black")))
    matrix = np.linalg.inv(camera.world_from_clip(1.0))
    entry = {"package": file.name, "picture": picture.name, "clip_from_world": np.round(matrix, 9).tolist()}
    return entry if point is None else {**entry, "point": point}


def write_samples(target: Path, names: list[str]) -> list[dict[str, object]]:
    """Write samples to a folder and return their entries."""
    entries = []
    with TemporaryDirectory() as folder:
        write_sources(Path(folder))
        for name in names:
            entries += write_sample(name, Path(folder), target)
    return _sorted(entries)


def _sorted(entries: list[dict[str, object]]) -> list[dict[str, object]]:
    return sorted(entries, key=lambda entry: str(entry["picture"]))


def names() -> list[str]:
    """Names of all samples."""
    return sorted(scene.stem for scene in (SAMPLES / "scenes").glob("*.toml"))


def main() -> None:
    chosen = sys.argv[1:] or names()
    path = SAMPLES / "samples.json"
    old = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    new = write_samples(SAMPLES, chosen)
    kept = [entry for entry in old if entry["package"].removesuffix(".volpkg.zip") not in chosen]
    path.write_text(json.dumps(_sorted(kept + new), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

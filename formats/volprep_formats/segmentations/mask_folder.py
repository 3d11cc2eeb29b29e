"""A folder with one mask per segment, as organ segmenters write it: the name of each file is that of its segment."""

import re
from pathlib import Path

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.volume_files import HEADERS, SUFFIXES
from volprep_formats.segmentations.label_volume import read_mask
from volprep_formats.segmentations.overlaps import Overlaps
from volprep_formats.segmentations.records import MOST_SEGMENTS, LabelVolume, SourceSegment, numbers_text

_MASK = re.compile(rf"(.+?)({'|'.join(map(re.escape, SUFFIXES))})", re.IGNORECASE)
_DATA = re.compile(r"(.+?)\.(?:z?raw|raw\.gz)", re.IGNORECASE)
_SAME_VOXELS = 1e-3


def has_masks(folder: Path) -> bool:
    """Return whether a folder has files that can be masks. Pictures beside them are previews, not slices."""
    return any(not file.name.startswith(".") and _MASK.fullmatch(file.name) for file in folder.iterdir())


def read_mask_folder(folder: Path, progress: Progress, scan: Grid | None) -> LabelVolume:
    """Read all masks in a folder. The grid of the scan limits their size.

    Raises VP1401, VP1402, VP1408 (grids differ), VP1413 and VP3290 (overlaps), and the errors of the readers.
    """
    visible = [file for file in folder.iterdir() if not file.name.startswith(".")]
    masks = {file: match for file in sorted(visible) if (match := _MASK.fullmatch(file.name))}
    files = list(masks)
    if not 0 < len(files) <= MOST_SEGMENTS:
        raise VolprepError("VP1401", path=folder, count=len(files), most=MOST_SEGMENTS)
    overlaps: Overlaps | None = None
    grid: Grid | None = None
    fractions: list[int] = []
    several: list[int] = []
    with_nan: list[int] = []
    for index, file in enumerate(files):
        mask = read_mask(file, progress, scan)
        own = mask.grid
        if overlaps is None or grid is None:
            grid, overlaps = own, Overlaps(folder, own.shape_zyx, len(files), scan)
        elif not same_grid(own, grid):
            raise VolprepError("VP1408", path=file, first=files[0].name, found=described(own), expected=described(grid))
        for z, inside in enumerate(mask.inside):
            overlaps.add(z, inside * np.uint16(index + 1))
        if mask.has_fractions:
            fractions.append(index + 1)
        if mask.has_several_numbers:
            several.append(index + 1)
        if mask.has_nan:
            with_nan.append(index + 1)
    if overlaps is None or grid is None:
        raise VolprepError("VP1401", path=folder, count=0, most=MOST_SEGMENTS)
    segments = tuple(SourceSegment(index + 1, match[1]) for index, match in enumerate(masks.values()))
    headers = {match[1] for match in masks.values() if match[2].lower() in HEADERS}
    data = [file for file in visible if (match := _DATA.fullmatch(file.name)) and match[1] in headers]
    others = len(visible) - len(files) - len(data)
    alone = "all of them count as inside. Give such a file alone to get a segment for each number"
    remarks = (
        (others, f"{others} other entries of the folder are no masks ({', '.join(SUFFIXES)}); left out"),
        (fractions, f"masks with fractions: {numbers_text(fractions)}; a voxel counts as inside from one half on"),
        (several, f"masks with several numbers above 0: {numbers_text(several)}; {alone}"),
        (with_nan, f"masks with NaN: {numbers_text(with_nan)}; these voxels count as outside"),
    )
    told = tuple(text for found, text in remarks if found)
    return LabelVolume(segments, grid, *overlaps.combined(), remarks=told)


def same_grid(one: Grid, other: Grid) -> bool:
    """Return whether the voxels of two grids lie at the same places, within a thousandth of a voxel."""
    if one.shape_zyx != other.shape_zyx:
        return False
    corners = np.array(np.meshgrid(*((0, n) for n in one.shape_zyx[::-1]), 1)).reshape(4, -1)
    apart = np.abs((one.world_from_index - other.world_from_index) @ corners).max()
    return bool(apart <= _SAME_VOXELS * min(one.spacing_mm_zyx))


def described(grid: Grid) -> str:
    """Say size, spacing and origin of a grid in one line."""
    size = "×".join(str(n) for n in grid.shape_zyx[::-1])
    spacing = " × ".join(f"{h:.4g}" for h in grid.spacing_mm_zyx[::-1])
    origin = ", ".join(f"{x:.4g}" for x in grid.origin_mm_xyz)
    return f"{size} voxels of {spacing} mm from ({origin}) mm"

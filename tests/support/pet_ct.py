"""A small trunk in DICOM: a CT with spine and ribs, and a PET or a dose of it on a grid of its own."""

from pathlib import Path
from typing import Any

import numpy as np
from dicom_files import image, save_all
from numpy.typing import NDArray
from pydicom.dataset import Dataset

FRAME = "1.2.826.0.1.3680043.9.77.1"
HOT_MM = (((45.0, -20.0, 30.0), 14.0), ((-40.0, 10.0, -45.0), 11.0))
"""Centre (LPS) and radius of two hot spots."""


def places(shape_zyx: tuple[int, int, int], spacing_zyx: tuple[float, float, float], shift: float = 0.0) -> NDArray:
    """World positions [z, y, x, xyz] of a grid around the origin, moved along all axes."""
    axes = [(np.arange(n) - (n - 1) / 2) * h + shift for n, h in zip(shape_zyx, spacing_zyx, strict=True)]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    return np.stack([x, y, z], axis=-1)


def soft(distance_mm: NDArray, width_mm: float = 4.0) -> NDArray:
    """1 inside (negative distances), 0 outside."""
    return np.clip(0.5 - distance_mm / width_mm, 0.0, 1.0)


def hounsfield(at: NDArray) -> NDArray:
    """Air, a body with lungs, a spine, and ribs."""
    x, y, z = np.moveaxis(at, -1, 0)
    body = soft((np.hypot(x / 120, y / 85) - 1) * 95)
    sides = (np.sqrt(((x - side) / 42) ** 2 + (y / 50) ** 2 + (z / 75) ** 2) for side in (55, -55))
    lungs = np.maximum(*(soft((side - 1) * 45) for side in sides))
    spine = soft(np.hypot(x, y - 55) - 14 - 2.5 * np.cos(z / 4.2))
    shell = np.abs(np.hypot(x / 108, y / 75) - 1) * 90
    ribs = soft(np.maximum(shell - 4, np.abs((z + 0.25 * y) % 24 - 12) - 4.5), 3.0)
    return -1000 + 1040 * body - 800 * lungs * body + 700 * np.maximum(spine, ribs)


def uptake(at: NDArray) -> NDArray:
    """Uptake from 0 to 1: two hot spots and a faint body."""
    x, y, _ = np.moveaxis(at, -1, 0)
    faint = 0.06 * soft((np.hypot(x / 120, y / 85) - 1) * 95, 8.0)
    spots = [soft(np.linalg.norm(at - np.array(centre), axis=-1) - radius, 8.0) for centre, radius in HOT_MM]
    return np.maximum.reduce([faint, spots[0], 0.7 * spots[1]])


def write_series(
    folder: Path, stored: NDArray[np.integer], at: NDArray, spacing_zyx: tuple[float, float, float], **attributes: Any
) -> Path:
    """Write slices of 16 bits with their positions."""
    slices: list[Dataset] = [
        image(pixels, at[k, 0, 0], spacing_mm_yx=spacing_zyx[1:], InstanceNumber=k + 1, **attributes)
        for k, pixels in enumerate(stored)
    ]
    folder.mkdir()
    return save_all(slices, folder)


def write_ct(folder: Path, shape_zyx: tuple[int, int, int] = (40, 56, 72)) -> Path:
    """Write the CT, of 4 mm."""
    spacing = (4.0 * 40 / shape_zyx[0], 4.0 * 56 / shape_zyx[1], 4.0 * 72 / shape_zyx[2])
    at = places(shape_zyx, spacing)
    stored = np.rint(hounsfield(at)).astype(np.int16)
    about = {"Modality": "CT", "SOPClassUID": "1.2.840.10008.5.1.4.1.1.2", "FrameOfReferenceUID": FRAME}
    rescale = {"RescaleSlope": "1", "RescaleIntercept": "0", "RescaleType": "HU"}
    return write_series(folder, stored, at, spacing, **about, **rescale)


def write_pet(folder: Path, frame: str | None = FRAME, **attributes: Any) -> Path:
    """Write the PET, of 5.2 mm and 6 mm, a little off the CT's grid; its largest value is 32000 Bq/ml."""
    spacing = (6.0, 5.2, 5.2)
    at = places((26, 42, 54), spacing, 1.3)
    stored = np.rint(32000 * uptake(at)).astype(np.uint16)
    about = {"Modality": "PT", "SOPClassUID": "1.2.840.10008.5.1.4.1.1.128", "SeriesInstanceUID": "1.2.3.9"}
    rescale = {"RescaleSlope": "1", "RescaleIntercept": "0", "Units": "BQML"}
    about |= {} if frame is None else {"FrameOfReferenceUID": frame}
    return write_series(folder, stored, at, spacing, **about, **rescale, **attributes)

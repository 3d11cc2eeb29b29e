"""Pictures of a package as arrays, and the transfer functions that they may have."""

from os import PathLike
from pathlib import Path
from typing import get_args

from volprep.pipeline.shot import Shot, draw
from volprep.scene.presets import load_preset, preset_names
from volprep.truth.picture import Background, encoded
from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Vector


def render_package(
    package: str | PathLike[str],
    *,
    view: str | None = None,
    eye_mm_xyz: Vector | None = None,
    shape_hw: tuple[int, int] = (512, 512),
    level: int | None = None,
    point: int | None = None,
    transfer: str | None = None,
    background: Background = "black",
    step_mm: float | None = None,
    fill: bool = True,
    edit: str | PathLike[str] | None = None,
) -> UInt8Array:
    """Draw a package off screen with OpenGL ES, with the shaders that it ships.

    Parameters
    ----------
    package
        The package, a folder or a zip.
    view
        Standard view: anterior, posterior, left, right, superior, inferior, anterior-left, anterior-right or
        posterior-left. If absent, anterior-left, or along the thin axis of a flat volume.
    eye_mm_xyz
        Look from this point of the patient's space (LPS) at the middle of the volume, instead of a standard view.
    shape_hw
        Height and width in pixels.
    level
        Level to draw; if absent, the finest.
    point
        Point of the grid whose sub-volumes are drawn, in place of a level.
    transfer
        Transfer function to draw with; if absent, the first.
    background
        Background behind the volume.
    step_mm
        Distance of the samples; if absent, the package's.
    fill
        Whether the visible part fills the picture; if not, all views show the volume in one size.
    edit
        TOML file of a transfer function to draw in place of the package's, which must be editable.

    Returns
    -------
    UInt8Array
        [H, W, 3] in sRGB, row 0 on top; [H, W, 4] for a transparent background.

    Raises
    ------
    VolprepError
        VP40xx for an unsound package, VP50xx for undrawable views, VP30xx for the file of a transfer function.
    """
    if background not in get_args(Background):
        raise VolprepError("VP5025", name=background, known=", ".join(get_args(Background)))
    shot = Shot(
        view=view,
        eye_mm_xyz=eye_mm_xyz,
        shape_hw=shape_hw,
        background=background,
        level=level,
        point=point,
        transfer=transfer,
        step_mm=step_mm,
        fill=fill,
        edit=None if edit is None else Path(edit),
    )
    picture, _ = draw(Path(package), shot)
    return encoded(picture, background)


def list_presets() -> dict[str, str]:
    """Return the transfer functions that come with volprep, as names and descriptions."""
    return {name: load_preset(name).shows for name in preset_names()}

"""A picture of a scan with each preset, to choose one by."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from volprep.pipeline.build import build
from volprep.pipeline.shot import Shot, take
from volprep.scene.presets import preset_names
from volprep.scene.request import Request
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.output import output_errors
from volprep_formats.progress import Progress, Silent

_SHOT = Shot(
    view=None,
    eye_mm_xyz=None,
    shape_hw=(256, 256),
    background="transparent",
    level=None,
    point=None,
    transfer=None,
    step_mm=None,
    fill=True,
)


@dataclass(frozen=True)
class PresetPicture:
    """The picture of one preset."""

    name: str
    """Name of the preset."""
    picture: Path | None
    """The PNG file; None if the preset does not fit the scan."""
    why_not: str
    """Why the preset does not fit, or why the picture is empty; otherwise nothing."""


def picture_paths(folder: Path) -> dict[str, Path]:
    """Return the file of each preset's picture, by the name of the preset."""
    return {name: folder / f"{name}.png" for name in preset_names()}


def draw_presets(request: Request, folder: Path, progress: Progress) -> list[PresetPicture]:
    """Build a package of the scan with each preset, and write a picture of each to `folder`.

    A preset that cannot draw the scan is left out. Raises the errors of `build` that have other causes than the preset,
    and of `take`.
    """
    paths = picture_paths(folder)
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    progress.start("presets", len(paths))
    drawn = []
    with TemporaryDirectory() as scratch:
        for name, path in paths.items():
            drawn.append(_draw(request.with_preset(name), name, path, Path(scratch)))
            progress.advance()
    return drawn


def _draw(request: Request, name: str, path: Path, scratch: Path) -> PresetPicture:
    package = scratch / f"{name}.volpkg"
    try:
        build(request, package, Silent())
    except VolprepError as error:
        if error.status is not ExitStatus.SCENE:
            raise
        return PresetPicture(name, None, error.summary.replace(str(package), "the scan"))
    seen = take(package, _SHOT, path).seen
    return PresetPicture(name, path, "" if seen else "nothing of the scan is seen")

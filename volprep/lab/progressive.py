"""A picture of a package frame by frame, as an app shows it while it is being finished."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from volprep.pipeline.framing import filled
from volprep.pipeline.shot import Shot, camera_of
from volprep.render.progressive import Order, ShownFrame, coarse_level, frames
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.truth.metrics import picture_error
from volprep.truth.picture import encoded
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import require_extra
from volprep_formats.output import new_folder
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes
from volprep_formats.record import Record

FRAMES_FILE = "frames.json"
"""File of `Frames`, beside the pictures."""


class FrameRecord(Record):
    """One frame."""

    file: str
    """Its picture."""
    finished: float
    """Part of the pixels, or of the samples along each ray, that is finished."""
    milliseconds: float
    """Time that drawing took since the frame before, without reading the picture back."""
    dssim: float
    """Structural dissimilarity to the last frame over black, (1 - SSIM) / 2."""


class Frames(Record):
    """A picture that is finished frame by frame."""

    order: Order
    """Order in which it is finished."""
    budget_ms: float
    """Time that a frame had."""
    driver: str
    """Driver that drew."""
    frames: tuple[FrameRecord, ...]
    """Its frames, the low resolution first."""


@dataclass(frozen=True)
class Finishing:
    """How a picture is finished."""

    order: Order | None = None
    """Order; if absent, that of the package's technique: slabs, tiles, or structured for all others."""
    budget_ms: float = 100.0
    """Time of a frame."""


def take_progressively(package_path: Path, shot: Shot, finishing: Finishing, folder: Path) -> Frames:
    """Draw a package frame by frame into a new folder of PNG files.

    Raises VP5041 for a package that cannot be drawn in that order, VP5021 if the folder cannot be written, VP7005
    without the extra `validate`, and the errors of `Renderer`.
    """
    require_extra("validate")
    package = Package.open(package_path)
    if not package.manifest.programs:
        raise VolprepError("VP5041", technique="slices")
    level = coarse_level(package, shot.transfer)
    with ExitStack() as stack:
        renderer, coarse = (
            stack.enter_context(
                ray_caster_of(package, value, shot.transfer)(package, level=value, transfer=shot.transfer)
            )
            for value in (shot.level, level)
        )
        order = finishing.order or _own_order(renderer)
        shown = [*_frames(package, renderer, coarse, order, shot, finishing)]
        driver = str(renderer.driver)
    records = []
    with new_folder(folder, "VP5021") as place:
        for number, frame in enumerate(shown):
            name = f"frame-{number:03}.png"
            (place / name).write_bytes(png_bytes(encoded(frame.picture, shot.background)))
            dssim = (1 - picture_error(frame.picture, shown[-1].picture).ssim_black) / 2
            records.append(FrameRecord(file=name, finished=frame.finished, milliseconds=frame.ms, dssim=dssim))
        found = Frames(order=order, budget_ms=finishing.budget_ms, driver=driver, frames=tuple(records))
        (place / FRAMES_FILE).write_text(found.model_dump_json(indent=2) + "\n", encoding="utf-8")
    return found


def _own_order(renderer: Renderer) -> Order:
    technique = renderer.program.technique
    return technique if technique in {"slabs", "tiles"} else "structured"


def _frames(  # noqa: PLR0917 - package, renderers and their tasks
    package: Package, renderer: Renderer, coarse: Renderer, order: Order, shot: Shot, finishing: Finishing
) -> Iterator[ShownFrame]:
    grid = package.manifest.levels[0].grid
    height, width = shot.shape_hw
    box_from_clip = camera_of(package.manifest, shot).box_from_clip(grid, width / max(height, 1))
    if shot.fill and min(shot.shape_hw) > 0:
        box_from_clip = filled(renderer, box_from_clip, shot.shape_hw)
    step_mm = shot.step_mm or renderer.nominal_mm
    budget_s = finishing.budget_ms / 1000
    return frames(renderer, order, box_from_clip, shot.shape_hw, step_mm, budget_s=budget_s, coarse=coarse)

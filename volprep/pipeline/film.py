"""Many pictures of a package in one film: the frames of a time series, a turn around the volume, or both at once."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from volprep.pipeline.framing import first_look, frame_of
from volprep.pipeline.shot import Shot, Taken, camera_of, rendered, renderer_for, taken_by
from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep.truth.picture import encoded
from volprep_formats.arrays import Float64Array, FloatArray, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.installation import require_extra
from volprep_formats.output import new_folder, new_path, require_place
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes
from volprep_formats.progress import Progress

if TYPE_CHECKING:
    from av import VideoStream

_TURN_S = 0.04
"""Seconds that each picture of a turn is seen."""
_UNTIMED_S = 0.1
"""Seconds that a frame is seen if the package does not say when it was taken; as the page has it."""
_TICKS = 1000
"""Units of time in a second."""
_ENCODERS = {".mp4": ("libx264", "yuv420p", {"crf": "16"}), ".webp": ("libwebp_anim", "bgra", {"quality": "90"})}
"""Encoder, pixels and quality, by ending."""
_BT_709, _SRGB = 1, 13
"""Matrix and primaries, and the curve, as H.273 numbers them."""


@dataclass(frozen=True)
class Film:
    """Wishes for a film."""

    turn: int
    """Pictures of one turn around the body's long axis; 0 for none."""
    frames: bool
    """Whether it plays the frames of a time series, each as long as it lasted, again and again through a turn."""


@dataclass(frozen=True)
class _Moment:
    """One picture."""

    frame: int
    degrees: float
    seconds: float


def film_kind(path: Path, shot: Shot) -> str:
    """Return the ending of a film, or nothing for a folder of PNG files.

    Raises VP5026 for another ending, and for what an MP4 cannot hold; VP7005 without PyAV; VP5021 where nothing can be
    written.
    """
    ending = path.suffix.lower()
    if ending and ending not in _ENCODERS:
        raise VolprepError("VP5026", path=path, problem=f"{ending} is no ending of a film")
    if ending == ".mp4" and (shot.background == "transparent" or shot.shape_hw[0] % 2 or shot.shape_hw[1] % 2):
        raise VolprepError("VP5026", path=path, problem="an MP4 has no transparent pixels, and even sides")
    if ending:
        require_extra("film")
        require_place(path, "VP5021")
    return ending


def shoot(package_path: Path, shot: Shot, film: Film, path: Path, progress: Progress) -> tuple[int, float, Taken]:
    """Draw a film into a file or a folder of `picture_000.png`; return the pictures, the seconds, and what drew them.

    Raises the errors of `film_kind` and `draw`, and VP5026 for frames of a package that is no time series.
    """
    kind = film_kind(path, shot)
    moments = _moments(Package.open(package_path).manifest, film, path)
    frame = _frame(package_path, shot, moments) if shot.fill else np.eye(4)
    first: list[Taken] = []

    def bytes_of() -> Iterator[tuple[UInt8Array, float]]:
        progress.start("pictures", len(moments))
        for moment, (picture, taken) in zip(moments, _pictures(package_path, shot, moments, frame), strict=True):
            first.append(taken)
            yield encoded(picture, shot.background), moment.seconds
            progress.advance()

    if kind:
        with new_path(path, "VP5021") as temporary:
            _write(temporary, kind, shot.shape_hw, bytes_of())
    else:
        with new_folder(path, "VP5021", replaces=True) as folder:
            for number, (picture, _) in enumerate(bytes_of()):
                (folder / f"picture_{number:03}.png").write_bytes(png_bytes(picture))
    return len(moments), sum(moment.seconds for moment in moments), first[0]


def _moments(manifest: Manifest, film: Film, path: Path) -> list[_Moment]:
    frames = manifest.frames or ()
    count = len(frames) if film.frames else 1
    if not count:
        raise VolprepError("VP5026", path=path, problem="the package is no time series, so it has no frames to play")
    lasts = _lasting([frame.time_s for frame in frames]) if film.frames else [_TURN_S]
    return [
        _Moment(number % count, 360.0 * number / film.turn if film.turn else 0.0, lasts[number % count])
        for number in range(film.turn or count)
    ]


def _lasting(times: list[float | None]) -> list[float]:
    """Return the seconds from each frame to the next one; the last one lasts as long as that before it."""
    if len(times) == 1 or any(time is None for time in times):
        return [_UNTIMED_S] * len(times)
    lasts = np.diff(np.array(times, dtype=np.float64)).tolist()
    return [*lasts, lasts[-1]]


def _frame(package_path: Path, shot: Shot, moments: list[_Moment]) -> Float64Array:
    """Return the frame that holds what is seen in all pictures."""
    looks = (
        first_look(renderer, matrix, shot.shape_hw, shot.step_mm)
        for renderer, _, matrix in _views(package_path, shot, moments)
    )
    return frame_of(reduce(np.maximum, looks))


def _pictures(
    package_path: Path, shot: Shot, moments: list[_Moment], frame: Float64Array
) -> Iterator[tuple[FloatArray, Taken]]:
    for renderer, package, box_from_clip in _views(package_path, shot, moments):
        picture = rendered(renderer, package, shot, box_from_clip @ frame)
        yield picture, taken_by(renderer, picture)


def _views(
    package_path: Path, shot: Shot, moments: list[_Moment]
) -> Iterator[tuple[Renderer | SliceRenderer, Package, Float64Array]]:
    """Yield a renderer of each moment, its package and its camera. Moments of one frame share the renderer."""
    for frame, group in groupby(moments, lambda moment: moment.frame):
        package = package_of_transfer(Package.open(package_path, frame=frame), shot.transfer)
        grid = package.manifest.box
        height, width = shot.shape_hw
        world_from_clip = camera_of(package.manifest, shot).world_from_clip(width / max(height, 1))
        with renderer_for(package, shot) as renderer:
            for moment in group:
                yield renderer, package, np.linalg.inv(grid.world_from_box) @ _turn(moment, grid) @ world_from_clip


def _turn(moment: _Moment, grid: Grid) -> Float64Array:
    """4×4 turn of the camera around the body's long axis through the middle of the volume, in world millimetres."""
    angle = math.radians(moment.degrees)
    turn, there = np.eye(4), np.eye(4)
    turn[:2, :2] = (math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))
    there[:, 3] = grid.world_from_box @ [*np.array(grid.extent_mm_zyx[::-1]) / 2, 1.0]
    return there @ turn @ np.linalg.inv(there)


def _write(path: Path, kind: str, shape_hw: tuple[int, int], pictures: Iterator[tuple[UInt8Array, float]]) -> None:
    """Encode pictures [H, W, 3] or [H, W, 4], each with the seconds that it is seen."""
    import av  # noqa: PLC0415 - only for films

    encoder, pixels, quality = _ENCODERS[kind]
    # WebP would play once.
    with av.open(str(path), "w", format=kind[1:], options={"loop": "0"} if kind == ".webp" else {}) as container:
        stream = cast("VideoStream", container.add_stream(encoder, options=quality))
        codec = stream.codec_context
        stream.time_base = codec.time_base = Fraction(1, _TICKS)
        codec.height, codec.width = shape_hw
        # With several threads the bytes may depend on their number.
        codec.pix_fmt, codec.thread_count = pixels, 1
        codec.colorspace, codec.color_primaries, codec.color_trc = _BT_709, _BT_709, _SRGB
        at = 0.0
        for picture, seconds in pictures:
            image = av.VideoFrame.from_ndarray(picture, format="rgba" if picture.shape[2] == 4 else "rgb24")
            image = image.reformat(format=pixels, dst_colorspace=_BT_709)
            image.pts, image.duration = round(at * _TICKS), round(seconds * _TICKS)
            image.time_base = stream.time_base
            container.mux(stream.encode(image))
            at += seconds
        container.mux(stream.encode())

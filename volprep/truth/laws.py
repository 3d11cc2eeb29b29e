"""Laws of light that a picture obeys whatever the step, the data and the transfer function."""

from collections.abc import Iterator

import numpy as np

from volprep_formats.arrays import FloatArray


def broken_laws(
    picture: FloatArray, rounding: float, fainter: FloatArray | None = None, left_out: float = 0.0
) -> Iterator[str]:
    """Describe the laws that a premultiplied linear `picture` [..., H, W, 4] breaks by more than `rounding`.

    `fainter` is the same scene with less extinction. `left_out` is the opacity that rays may leave out when they stop
    early: a ray that continues at a slightly lower opacity may end with a higher one.
    """
    if not np.isfinite(picture).all():
        yield "a pixel is no finite number"
        return
    colour, opacity = picture[..., :3], picture[..., 3]
    if opacity.min() < -rounding or opacity.max() > 1 + rounding:
        yield f"opacity goes from {opacity.min():.4g} to {opacity.max():.4g}"
    if colour.min() < -rounding:
        yield f"a colour is {colour.min():.4g}"
    brighter = (colour.max(axis=-1) - opacity).max()
    if brighter > rounding:
        yield f"a colour is brighter than its opacity by {brighter:.4g}"
    if fainter is not None and (lost := (fainter[..., 3] - opacity).max()) > rounding + left_out:
        yield f"with more extinction a pixel is less opaque by {lost:.4g}"

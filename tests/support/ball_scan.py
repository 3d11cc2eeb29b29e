"""A soft ball beside the middle of an anisotropic raw volume of odd sizes."""

from pathlib import Path

import numpy as np


def write_ball(folder: Path) -> None:
    """Write `ball.raw`: 12×15×17 bytes, 1.5, 1 and 0.9 mm apart."""
    z, y, x = np.meshgrid(*(np.arange(n) * h for n, h in ((12, 1.5), (15, 1.0), (17, 0.9))), indexing="ij")
    ball = 220 * np.exp(-((z - 8) ** 2 + (y - 6) ** 2 + (x - 9) ** 2) / 30)
    ball.astype(np.uint8).tofile(folder / "ball.raw")

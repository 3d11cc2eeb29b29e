"""What lies behind the place where rays end, of several transfer functions."""

import numpy as np
from tiny_packages import function

from volprep.parts.programs.early_end import behind_cutoff
from volprep_formats.package.transfer_function import TransferFunction


def opaque(name: str, *points: tuple[float, float]) -> TransferFunction:
    return function(*((value, (1.0, 1.0, 1.0), extinction) for value, extinction in points), name=name)


def test_the_greatest_of_each_number_counts_whichever_function_has_it() -> None:
    """Rays of one value in front and another one behind, from one side.

    The wall hides more samples, which show nothing; of the fog fewer lie behind, but each of them is lit.
    """
    rays = np.full((40, 1), 200.0)
    rays[:10] = 50.0
    wall = opaque("wall", (0.0, 0.0), (49.0, 0.0), (50.0, 100.0), (51.0, 0.0), (255.0, 0.0))
    fog = opaque("fog", (0.0, 0.0), (100.0, 0.0), (101.0, 0.3), (255.0, 0.3))

    def found(*functions: TransferFunction) -> tuple[float, float]:
        return behind_cutoff(functions, [rays], [1.0], "nearest", 0.99, 5.0)

    (most_behind, wall_saved), (fog_behind, most_saved) = found(wall), found(fog)
    assert most_behind > fog_behind
    assert most_saved > wall_saved
    assert found(wall, fog) == found(fog, wall) == (most_behind, most_saved)

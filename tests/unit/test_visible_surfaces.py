"""What can be seen of a transfer function where a surface is shown."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.compositing import COMPOSITINGS
from volprep_formats.package.function_table import Table

WHITE = (1.0, 1.0, 1.0)
FUNCTIONS = {
    "one point, at the isovalue": function((22.0, WHITE, 1.0)),
    "two points, far away": function((0.0, WHITE, 1.0), (255.0, WHITE, 1.0)),
    "a jump at the isovalue": function((0.0, WHITE, 1.0), (22.0, WHITE, 1.0), (22.0, WHITE, 2.0), (90.0, WHITE, 1.0)),
}


@pytest.mark.parametrize("shown", FUNCTIONS.values(), ids=FUNCTIONS.keys())
def test_ranges_around_the_isovalue_are_seen_and_no_others(shown) -> None:
    exact = Table.exact(shown.model_copy(update={"isovalue": 22.0}))
    isosurface, solid = (COMPOSITINGS[name].visible_table(exact) for name in ("isosurface", "first-hit"))
    for low, high in ((0.0, 30.0), (22.0, 22.0), (0.0, 22.0), (22.0, 90.0)):
        assert isosurface.largest_extinction(low, high) > 0
        assert solid.largest_extinction(low, high) > 0
    assert isosurface.largest_extinction(0.0, 21.999) == 0
    assert solid.largest_extinction(0.0, 21.999) == 0
    assert isosurface.largest_extinction(22.001, 255.0) == 0
    assert solid.largest_extinction(22.001, 255.0) > 0


@pytest.mark.parametrize("isovalue", [0.0, 21.7, 22.0, 255.0])
def test_entries_of_a_table_on_both_sides_of_the_isovalue_are_seen(isovalue) -> None:
    table = Table.exact(function((0.0, WHITE, 1.0)).model_copy(update={"isovalue": isovalue}))
    seen = COMPOSITINGS["isosurface"].visible(table.resampled((0.0, 255.0), 256)) > 0
    wanted = np.abs(np.arange(256) - isovalue) < 1
    np.testing.assert_array_equal(seen, wanted)

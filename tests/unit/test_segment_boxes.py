"""The boxes of labels against SciPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy.ndimage import find_objects

from volprep.scan.segments.record import _boxes

COUNT = 6
labels = arrays(np.uint8, array_shapes(min_dims=3, max_dims=3, max_side=7), elements=st.integers(0, COUNT - 2))


@given(labels)
def test_the_box_of_each_label_holds_all_its_voxels_and_no_more(labels) -> None:
    boxes = [None if box is None else (box.start_zyx, box.stop_zyx) for box in _boxes(labels, COUNT)]
    found = [
        box and (tuple(side.start for side in box), tuple(side.stop for side in box))
        for box in find_objects(labels.astype(np.int32) + 1, COUNT)
    ]
    assert boxes == found

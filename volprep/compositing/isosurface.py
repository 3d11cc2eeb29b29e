"""Isosurface: the first place on the ray where the value passes the isovalue, from either side.

The transfer function gives the colour of the isovalue; its opacity is that of reference_mm. Where the box cuts the
surface one looks inside.
"""

import numpy as np

from volprep.compositing.surface import isovalue_of, next_values, surface
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def _visible(table: Table) -> Float64Array:
    isovalue = isovalue_of(table)
    before, after = next_values(table)
    return np.where((before < isovalue) & (isovalue < after), 1.0, 0.0)


ISOSURFACE = surface("isosurface", _visible, solid=False, truth="the isosurface of the scan, at exact roots")

"""Lookup tables adapted to a coarse level, so that its pictures come as near as they can to those of level 0.

A voxel of a coarse level is a mixture, and what its value should look like depends on what was mixed: a thin vessel has
become a faint one, the border of a bone a broad one. The table is fitted to light: along random rays the light of level
0 is known, and the entries are moved by Gauss-Newton steps until the light of the level misses it least in the square.
Changes are linear between at most 256 knots, and rough changes cost a little, so that values that no ray meets follow
their neighbours. The method is volprep's own.

The extinction changes through its square root, so that it stays positive; and what the transfer function does not show
stays invisible, so that empty space is empty on every level.
"""

import numpy as np

from volprep.kernels import _native
from volprep.parts.levels.rays import RaySamples
from volprep_formats.arrays import Float64Array

_KNOTS = 64
_STEPS = 8
_ROUGHNESS = 1e-4
"""Cost of a squared difference of 1 between the changes of neighbouring knots, in mean squared light: with 1e-3 the
tables gain a hundredth less, with 1e-5 they follow the rays instead of the volume."""
_LEAST_GAIN = 1e-3
"""A step that lowers the cost by less than this part is the last one."""


def fitted_table(samples: RaySamples, target: Float64Array, common: Float64Array) -> Float64Array:
    """Fit a lookup table to the light of rays.

    Parameters
    ----------
    samples
        The level's codes along the rays.
    target
        Light [n, 4] of level 0 along the same rays: premultiplied linear colour and opacity.
    common
        The table [entries, 4] of level 0, linear colour and extinction per millimetre: where the fit begins.

    Returns
    -------
    NDArray
        A table of the same shape. Its extinction is 0 wherever that of `common` is.
    """
    fit = _Fit(samples, target, common)
    change = np.zeros(4 * fit.knots)
    cost = fit.cost(change)
    damping = 1e-3
    for _ in range(_STEPS):
        matrix, gradient = fit.equations(change)
        found, damping = fit.step(change, cost, matrix, gradient, damping)
        if found is None:
            break
        change, lower = found
        gain, cost = (cost - lower) / cost, lower
        if gain < _LEAST_GAIN:
            break
    return fit.table(change)


class _Fit:
    """One problem: what changes of the knots make of the table, and what they cost."""

    def __init__(self, samples: RaySamples, target: Float64Array, common: Float64Array) -> None:
        self._samples = samples
        self._target = target
        self._common = common
        self.knots = min(_KNOTS, len(common))
        self._positions = np.linspace(0.0, 1.0, len(common))
        self._at_knots = np.linspace(0.0, 1.0, self.knots)
        # The unit of the root, so that the cost of a change is the same whatever the extinction.
        self._unit = float(np.sqrt(common[:, 3].max())) or 1.0
        self._root = np.sqrt(common[:, 3])

    def table(self, change: Float64Array) -> Float64Array:
        """Return the table after a change of the knots."""
        changes = np.column_stack(
            [np.interp(self._positions, self._at_knots, part) for part in change.reshape(4, self.knots)]
        )
        colour = np.clip(self._common[:, :3] + changes[:, :3], 0.0, 1.0)
        root = np.maximum(self._root + changes[:, 3] * self._unit, 0.0)
        root[self._root == 0.0] = 0.0
        return np.ascontiguousarray(np.column_stack([colour, root**2]))

    def cost(self, change: Float64Array) -> float:
        """Mean squared error of the light, and the roughness of the change."""
        error = self._samples.light(self.table(change)) - self._target
        return float((error**2).sum()) / len(error) + float((change * _roughness(change, self.knots)).sum())

    def equations(self, change: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Gauss-Newton's matrix and gradient."""
        samples = self._samples
        n = 4 * self.knots
        matrix, gradient = np.empty((n, n)), np.empty(n)
        table = self.table(change)
        _native.light_equations(
            samples.values, samples.offsets, samples.lengths_mm, samples.scale, table, self._target, matrix, gradient
        )
        units = np.ones(n)
        units[3 * self.knots :] = self._unit
        matrix *= units[:, None] * units
        return matrix + _roughness(np.eye(n), self.knots), gradient * units + _roughness(change, self.knots)

    def step(
        self, change: Float64Array, cost: float, matrix: Float64Array, gradient: Float64Array, damping: float
    ) -> tuple[tuple[Float64Array, float] | None, float]:
        """Return a change that costs less, its cost, and the damping of the next step; none where none is found."""
        size = float(np.diagonal(matrix).mean())
        while damping < 1e3:
            damped, move = matrix + damping * size * np.eye(len(gradient)), gradient.copy()
            if _native.solve_positive(damped, move):
                tried = change - move
                lower = self.cost(tried)
                if lower < cost:
                    return (tried, lower), max(damping / 5, 1e-6)
            damping *= 10
        return None, damping


def _roughness(change: Float64Array, knots: int) -> Float64Array:
    """Half the gradient of the sum of squared differences of neighbouring knots, times its cost; of each column."""
    parts = change.reshape(4, knots, -1)
    differences = np.diff(parts, axis=1)
    result = np.zeros_like(parts)
    result[:, 1:] += differences
    result[:, :-1] -= differences
    return _ROUGHNESS * result.reshape(change.shape)

"""What is studied: phantoms, and the scans of the benchmark of levels, as codes with their transfer functions."""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.bench_levels import SCENES, request_of
from tests.levels_study.phantoms import Phantom, phantoms
from volprep.parts.work import codes_of_source
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stage_graph import STAGES
from volprep.pipeline.stages import run_stage
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent


@dataclass(frozen=True)
class Subject:
    """Codes of a volume, and one transfer function."""

    name: str
    """Name."""
    codes: NDArray[np.generic]
    """[z, y, x]: uint8 or uint16."""
    grid: Grid
    """Where they are."""
    window: tuple[float, float]
    """Physical values of the smallest code and the largest."""
    function: TransferFunction
    """Transfer function."""
    held_out: bool = False
    """Whether nothing was tuned on it."""


def phantom_subjects(size: int) -> Iterator[Subject]:
    """Return the phantoms, and two of them with 16 bits."""
    for phantom in phantoms(size):
        yield _of_phantom(phantom)
        if phantom.name in {"vessels 1", "soft tissue"}:
            eight = _of_phantom(phantom)
            codes = eight.codes.astype(np.uint16) * np.uint16(257)
            yield Subject(f"{eight.name}, 16 bits", codes, eight.grid, eight.window, eight.function)


def scan_subjects(data: Path, is_wanted: Callable[[str], bool]) -> Iterator[Subject]:
    """Return the scans below `data` with each of their transfer functions, quantized as a build does it.

    Scans of which no subject is wanted by name are not read.
    """
    for name, (_, functions) in SCENES.items():
        if not any(is_wanted(f"{name}, {function}") for function in functions):
            continue
        with tempfile.TemporaryDirectory() as folder:
            request = request_of(name, data, Path(folder))
            draft = import_draft(prepare(request), Path(folder) / "draft", Silent()).draft
            whole = plan_draft(draft, request.scene, request.profile, Silent())
            run_stage(draft, next(each for each in STAGES if each.name == "quantize"), whole, request.scene, Silent())
            (plan,) = whole.channels
            volume = codes_of_source(draft, plan)
            codes = volume.read_slab(0, volume.shape_zyx[0]).copy()
            for function in plan.transfer_functions:
                yield Subject(f"{name}, {function.name}", codes, plan.grid, plan.quantize.window, function)


def _of_phantom(phantom: Phantom) -> Subject:
    points = tuple(
        TransferPoint(value=value, colour=colour, extinction_per_mm=extinction)
        for value, colour, extinction in phantom.points
    )
    grid = Grid.of(phantom.voxels.shape, (1.0, 1.0, 1.0))
    function = TransferFunction(name="thing", points=points)
    return Subject(phantom.name, phantom.voxels, grid, (0.0, 255.0), function, phantom.held_out)

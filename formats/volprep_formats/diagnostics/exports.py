"""Exports and judged pyramids: VP133x."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
    "VP1330": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the package holds no labels",
        "Choose a package with segments or of a label map. A draft has none yet.",
    ),
    "VP1331": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds {problem}, and a segmentation belongs to one",
        "Give the folder that holds the DICOM files of the series, and nothing else.",
    ),
    "VP1332": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the voxels of the package are not those of this series: they are off by {off} voxels",
        "Give the series that the package was made of, and level 0. Packages of repaired slices have voxels of their "
        "own.",
    ),
    "VP1333": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the picture shows no surface: {reason}",
        "Choose a transfer function of a compositing that accumulates opacity or shows an isovalue, and that is opaque "
        "somewhere.",
    ),
    "VP1334": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: there is nothing to judge: {problem}",
        "Give a pyramid of several levels, and a scene with transfer functions over its values.",
    ),
}

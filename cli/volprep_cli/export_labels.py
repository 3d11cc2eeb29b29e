"""volprep export of segments: .seg.nrrd of 3D Slicer, NIfTI labels with their table, DICOM SEG."""

from pathlib import Path

from volprep_cli.console import print_done, progress, voxels_text
from volprep_cli.outputs import require_new


def export_labels(
    package: Path, file: Path, level: int | None, channel: str | None, series: Path | None, *, force: bool
) -> None:
    """Write the segments of a level of a package, or the labels of a label map. Raises VP1330 and VP1250 to VP1252."""
    from volprep_formats.output import require_place
    from volprep_formats.writers.package_labels import labels_of_level

    kind = _kind(file, series)
    require_new(file, force=force)
    require_place(file)
    image, source = labels_of_level(package, level, channel)
    with progress() as watcher, source:
        if kind == "nifti":
            from volprep_formats.writers.nifti import write_labels

            write_labels(image, source, file, watcher)
        elif series is None:
            from volprep_formats.writers.seg_nrrd import write

            write(image, source, file, watcher)
        else:
            from volprep_formats.writers import dicom_seg

            dicom_seg.write(image, source, file, watcher, series=series)
        shape_zyx = source.info.grid.shape_zyx
    names = [segment.name for segment in image.segments]
    told = f"{file}: {voxels_text(shape_zyx)} voxels, {len(names)} segments, {kind}"
    print_done(told, file=str(file), format=kind, shape_zyx=list(shape_zyx), segments=names)


def _kind(file: Path, series: Path | None) -> str:
    """Return the format of a file of segments."""
    from volprep_formats.diagnostics import VolprepError

    name = file.name.lower()
    if series is not None and name.endswith(".dcm"):
        return "dicom-seg"
    if series is None and name.endswith(".seg.nrrd"):
        return "seg-nrrd"
    if series is None and name.endswith((".nii", ".nii.gz")):
        return "nifti"
    raise VolprepError("VP1252", path=file)

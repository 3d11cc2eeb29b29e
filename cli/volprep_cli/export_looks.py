"""volprep export of looks: alone as JSON, or beside the voxels as glTF with EXT_voxels (draft)."""

from pathlib import Path

from volprep_cli.console import print_done, print_note, progress, voxels_text
from volprep_cli.outputs import require_new


def export_looks(package: Path, file: Path, level: int | None, channel: str | None, *, frame: int, force: bool) -> None:
    """Write the looks of a package; into a .glb file together with the voxels of a level, the finest if None."""
    from volprep_formats.diagnostics import VolprepError
    from volprep_formats.output import new_file, require_place
    from volprep_formats.package.look import looks_of, of_channels
    from volprep_formats.package.reader import Package
    from volprep_formats.readers.volpkg import open_levels
    from volprep_formats.writers.voxels_glb import write

    if file.suffix.lower() not in {".json", ".glb"}:
        raise VolprepError("VP1252", path=file)
    require_new(file, force=force)
    require_place(file)
    looks = looks_of(Package.open(package, allow_draft=True).manifest)
    told: dict[str, object] = {"file": str(file), "looks": [look.name for look in looks.looks]}
    if file.suffix.lower() == ".json":
        with new_file(file) as opened:
            opened.write(looks.model_dump_json(indent=1, exclude_none=True).encode() + b"\n")
        line = f"{len(looks.looks)} looks"
    else:
        levels = open_levels(package, level, channel, frame)
        names = [manifest.channels[0].name for manifest in levels.manifests]
        _, sources = next(levels.levels)
        shape_zyx = sources[0].info.grid.shape_zyx
        with progress() as watcher:
            write(sources, names, of_channels(looks, names), file, watcher)
        levels.levels.close()
        told |= {"shape_zyx": list(shape_zyx), "channels": names}
        line = f"{voxels_text(shape_zyx)} voxels, physical values of {', '.join(names)}, glTF with EXT_voxels"
        print_note(f"{file}: EXT_voxels and glTF 2.1 are drafts; few programs read them yet, and they may change")
    print_done(f"{file}: {line}", **told)

"""volprep export of surfaces: glTF, USDZ, PLY and STL, with their error against the volume."""

from pathlib import Path

from volprep_cli.console import print_json, print_line, print_note, progress, wants_json
from volprep_cli.outputs import require_new


def export_surface(
    package: Path,
    file: Path,
    level: int | None,
    transfer: str | None,
    within_mm: float | None,
    *,
    frame: int,
    draco: bool,
    force: bool,
) -> None:
    """Write the surface that a picture shows. Raises VP1333 where it shows none."""
    from volprep.surface.surfaces import surfaces_of
    from volprep_formats.output import require_place
    from volprep_formats.package.reader import Package
    from volprep_formats.writers.surface_files import write_surfaces

    require_new(file, force=force)
    require_place(file)
    with progress() as watcher:
        surfaces = surfaces_of(package, watcher, level=level, transfer=transfer, within_mm=within_mm, frame=frame)
        write_surfaces(surfaces, file, draco=draco)
    if wants_json():
        print_json({"file": str(file), **surfaces.facts.model_dump(mode="json")})
        return
    print_line(f"{file}: {surfaces.facts.surface}")
    shown = surfaces.facts.function
    functions = Package.open(package, allow_draft=True).manifest.transfer_functions
    others = [function.name for function in functions if function.name != shown]
    if transfer is None and others:
        print_note(f"{file}: the surface of {shown}; --transfer NAME writes that of {', '.join(others)}")
    for node in surfaces.facts.nodes:
        error = node.error
        closed = "closed" if node.watertight else "not closed"
        apart = "no ray hits both" if error.p95_mm is None else f"95 % of rays within {error.p95_mm:.3g} mm"
        print_line(
            f"  {node.name}: {node.triangles} triangles, {closed}; {apart}, {100 * error.missed:.2g} % hit only one"
        )

"""volprep plan: what a package of a scene would hold, and why."""

from volprep_cli.build import Profile, Scene, Source
from volprep_cli.console import Json, bytes_text, print_json, print_table, progress


def plan(scene: Scene, profile: Profile = None, source: Source = None, as_json: Json = False) -> None:
    """Print what a package would hold, why, and what it costs.

    It reads the whole source and writes nothing. Transfer functions that come with volprep (preset = "NAME" in
    [[transfer]] of the scene): angiography, ct-bone, ct-soft-tissue, labels, micro-ct, mr-head.
    """
    from volprep.pipeline.build import plan_build  # noqa: PLC0415 - keeps volprep --help fast
    from volprep.scene.request import request_of  # noqa: PLC0415

    request = request_of(scene, profile, source)
    with progress() as watcher:
        decided = plan_build(request, watcher)
    if as_json:
        print_json(decided.model_dump(mode="json", exclude_none=True))
        return
    rows = [
        (item.name, "kept" if item.kept else "left out", bytes_text(item.size_bytes), item.reason, " ".join(item.files))
        for item in decided.items
    ]
    print_table(("item", "", "cost", "reason", "files"), rows)
    total = sum(item.size_bytes for item in decided.items if item.kept)
    print(f"stages: {', '.join(decided.stages)}; {bytes_text(total)} of textures for profile {decided.profile.name}")

"""volprep plan: what a package of a scene would hold, and why."""

from volprep_cli.build import Profile, Scene, Source
from volprep_cli.console import Json, bytes_text, print_json, print_line, print_table, progress


def plan(scene: Scene, profile: Profile = None, source: Source = None, as_json: Json = False) -> None:
    """Print what a package would hold, why, and what it costs.

    It reads the whole source and writes nothing. Transfer functions that come with volprep (preset = "NAME" in
    [[transfer]] of the scene): angiography, ct-bone, ct-soft-tissue, labels, micro-ct, mr-head.
    """
    from volprep.pipeline.build import plan_build
    from volprep.scene.request import request_of

    request = request_of(scene, profile, source)
    with progress() as watcher:
        decided = plan_build(request, watcher)
    if as_json:
        print_json(decided.model_dump(mode="json", exclude_none=True))
        return
    rows = [
        (
            item.name,
            item.channel or "",
            "kept" if item.kept else "left out",
            bytes_text(item.size_bytes),
            item.reason,
            " ".join(item.files),
        )
        for item in decided.items
    ]
    print_table(("item", "channel", "", "cost", "reason", "files"), rows)
    total = bytes_text(sum(item.size_bytes for item in decided.items if item.kept))
    print_line(f"stages: {', '.join(decided.stages)}; {total} of textures for profile {decided.shared.profile.name}")

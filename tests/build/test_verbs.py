"""Verbs in any order that their needs allow end in the package that `build` makes."""

import random
from pathlib import Path

import pytest
import scene_builds
from tamper_scenes import write_kind

from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import begin_draft, scene_of
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.stage_graph import STAGES, dependents, in_order
from volprep.scene.request import load_request
from volprep.scene.scene import Scene, changed
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Silent

WISHES = (
    ("skip", {"kind": "none"}),
    ("skip", {"kind": "blocks", "block": 3}),
    ("skip", {"ranges": True}),
    ("transfer", {"classification": "palette", "palette_entries": 32}),
    ("transfer", {"classification": "lookup"}),
    ("quantize", {"bits": 8, "window": (10.0, 240.0)}),
    ("pyramid", {"coarsest_longest_axis": 9}),
    ("pyramid", {"filter": "maximum"}),
    ("normals", {"kernel": "central"}),
    ("grid", {"size": 9}),
    ("proxy", {"form": "box"}),
)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def begun(folder: Path, kind: str) -> tuple[Path, Scene]:
    """Import the scan of a kind of scene into a draft."""
    request = load_request(write_kind(folder, kind))
    draft = folder / "draft.volpkg"
    begin_draft(request, draft, Silent())
    return draft, scene_of(Draft.open(draft))


def verb(draft: Path, name: str, change=lambda scene: scene) -> str | None:
    """Run a verb; return the code of its error, if it has one."""
    try:
        run_verb(draft, name, change, Silent())
    except VolprepError as error:
        return error.code
    return None


def wish(draft: Path, name: str, wishes: dict) -> str | None:
    return verb(draft, name, lambda scene: changed(scene, {"transfer": "render"}.get(name, name), **wishes))


def finish(path: Path, chance: random.Random) -> None:
    """Run every stage that is missing, in a random order that their needs allow, then seal."""
    draft = Draft.open(path)
    planned = plan_draft(draft, scene_of(draft), draft.manifest.profile, Silent()).stages
    reads = {stage.name: set(stage.reads) & set(planned) for stage in STAGES}
    while True:
        done = {record.name for record in Draft.open(path).manifest.stages}
        ready = [name for name in planned if name not in done | {"seal", "import"} and reads[name] <= done]
        if not ready:
            break
        assert verb(path, chance.choice(ready)) is None
    assert verb(path, "seal") is None


@pytest.mark.long(keep=1)
@pytest.mark.usefixtures("stages_run_for_each_plan")
@pytest.mark.parametrize(("kind", "seed"), [("house", 1), ("house", 2), ("bricks", 3), ("fitted", 4), ("slices", 5)])
def test_any_order_with_wishes_that_come_and_go_ends_in_the_package_of_build(tmp_path, kind, seed) -> None:
    draft, scene = begun(tmp_path, kind)
    chance = random.Random(seed)  # noqa: S311 - the order of verbs is no secret
    names = [stage.name for stage in STAGES if stage.name != "seal"]
    for name in names[: chance.randrange(4, len(names))]:
        verb(draft, name)
    for name, wishes in chance.sample(WISHES, 4):
        assert wish(draft, name, wishes) in {None, "VP4040", "VP3023", "VP3041", "VP3022", "VP3060"}
        verb(draft, chance.choice(names))
    assert verb(draft, "quantize", lambda _: scene) is None
    assert scene_of(Draft.open(draft)) == scene
    finish(draft, chance)
    built = tmp_path / "built.volpkg"
    scene_builds.built(tmp_path / "tried.toml", built)
    assert contents(draft) == contents(built)


def sealed_but_for_seal(tmp_path: Path, kind: str = "house") -> Path:
    draft, _ = begun(tmp_path, kind)
    for stage in STAGES[:-1]:
        verb(draft, stage.name)
    return draft


def stages_of(path: Path) -> set[str]:
    return {record.name for record in Draft.open(path).manifest.stages}


def test_a_stage_that_runs_again_drops_what_reads_it_and_nothing_else(tmp_path) -> None:
    draft = sealed_but_for_seal(tmp_path)
    before = stages_of(draft)
    assert {"grid", "skip", "proxy", "normals", "texture", "shaders"} <= before
    assert wish(draft, "skip", {"block": 3}) is None
    assert before - stages_of(draft) == {"shaders"}
    assert list((draft / "subvolumes").glob("*.ktx2"))


def test_skip_tables_that_are_no_longer_wanted_go_with_one_verb(tmp_path) -> None:
    draft = sealed_but_for_seal(tmp_path)
    assert wish(draft, "skip", {"kind": "none"}) is None
    assert scene_of(Draft.open(draft)).skip.kind == "none"
    assert not list((draft / "textures").glob("skip-*"))
    assert verb(draft, "shaders") is None
    assert verb(draft, "seal") is None


def test_another_classification_runs_again_what_it_concerns(tmp_path) -> None:
    draft = sealed_but_for_seal(tmp_path, "fitted")
    assert wish(draft, "transfer", {"classification": "preintegrated"}) is None
    assert {"pyramid", "transfer"} <= stages_of(draft)
    for name in ("texture", "shaders", "seal"):
        assert verb(draft, name) is None
    assert any(path.name.startswith("preintegrated-") for path in (draft / "textures").iterdir())


def test_a_wish_that_changes_no_file_yet_is_kept(tmp_path) -> None:
    draft = sealed_but_for_seal(tmp_path)
    assert wish(draft, "transfer", {"palette_entries": 17}) is None
    assert scene_of(Draft.open(draft)).render.palette_entries == 17


def test_a_verb_that_the_scene_does_not_need_is_refused(tmp_path) -> None:
    draft = sealed_but_for_seal(tmp_path, "fitted")
    assert verb(draft, "mosaic") == "VP3023"


def test_the_order_of_stages_follows_from_what_they_read() -> None:
    assert in_order(STAGES[::-1]) != STAGES[::-1]
    for place, stage in enumerate(STAGES):
        assert set(stage.reads) - {"import"} <= {earlier.name for earlier in STAGES[:place]}
    assert dependents("texture") == {"shaders", "fidelity", "frames", "seal"}

"""A manifest is put together from what its stages have added."""

import pytest

from volprep_formats.package.assemble import assembled, joined
from volprep_formats.package.channel import ChannelPart
from volprep_formats.package.manifest import Contribution, Manifest, StageRecord
from volprep_formats.package.parts.skip.record import BlockRangesRecord, Skipping, SkipTable
from volprep_formats.package.storage.draft import Draft

KEY = "0" * 64


def table(transfer: str) -> SkipTable:
    return SkipTable(
        texture=f"skip-{transfer}-0",
        level=0,
        transfer=transfer,
        kind="distance",
        block=4,
        blocks_zyx=(1, 1, 1),
        empty_share=0.5,
    )


def with_stage(draft: Draft, *made: Contribution) -> Manifest:
    """The manifest after a stage more."""
    manifest = draft.manifest
    more = StageRecord(name="more", key=KEY, made=made)
    return assembled(manifest, (*manifest.stages, more), manifest.files, "draft")


def test_what_stages_have_added_is_the_manifest(draft: Draft) -> None:
    manifest = draft.manifest
    assert assembled(manifest, manifest.stages, manifest.files, "draft") == manifest
    without = assembled(manifest, manifest.stages[:1], manifest.files, "draft")
    assert without.textures == ()
    assert [channel.levels for channel in without.channels] == [()]
    assert without.source == manifest.source


def test_textures_stand_in_order_of_name_whoever_made_them(draft: Draft) -> None:
    (first, *_) = draft.manifest.textures
    made = (Contribution(textures=(first.model_copy(update={"name": name}),)) for name in ("zebra", "aardvark"))
    names = [texture.name for texture in with_stage(draft, *made).textures]
    assert names == sorted(["zebra", "aardvark", *(texture.name for texture in draft.manifest.textures)])


def test_a_channel_is_what_all_stages_say_of_its_name(draft: Draft) -> None:
    (scan,) = draft.manifest.channels
    (bone,) = scan.transfer_functions
    skin = bone.model_copy(update={"name": "skin"})
    other = ChannelPart(name="other", source=scan.source, statistics=scan.statistics)
    manifest = with_stage(
        draft, Contribution(channel=ChannelPart(name="scan", transfer_functions=(skin,))), Contribution(channel=other)
    )
    assert [channel.name for channel in manifest.channels] == ["scan", "other"]
    assert manifest.channels[0] == scan.model_copy(update={"transfer_functions": (bone, skin)})
    assert manifest.channels[1].levels == ()
    assert [function.name for function in manifest.transfer_functions] == ["bone", "skin"]


def test_skipping_of_channels_is_one_list_and_says_once_what_counts_for_all(draft: Draft) -> None:
    ranges = BlockRangesRecord(texture="ranges-scan-0", level=0, block=4, blocks_zyx=(1, 1, 1))
    first = Contribution(skipping=Skipping(tables=(table("a"),)))
    second = Contribution(skipping=Skipping(epsilon=0.25, tables=(table("b"),), ranges=(ranges,)))
    found = with_stage(draft, first, second).skipping
    assert found == Skipping(epsilon=0.25, tables=(table("a"), table("b")), ranges=(ranges,))


def test_of_nothing_nothing_is_joined(draft: Draft) -> None:
    assert joined([]) is None
    assert joined([None, None]) is None
    assert with_stage(draft).skipping is None


def test_a_channel_without_a_source_is_none(draft: Draft) -> None:
    with pytest.raises(ValueError, match="source"):
        with_stage(draft, Contribution(channel=ChannelPart(name="air")))

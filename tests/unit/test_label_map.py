"""Label maps are recognised by what a file says and by its voxels; pictures are not taken for them."""

from pathlib import Path

import numpy as np
import pytest

from volprep.pipeline.build import build
from volprep.pipeline.prepare import prepare
from volprep.scan.label_map import Recognised, _Sample, _sampled, recognise_labels
from volprep.scene.request import request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

SHAPE = (20, 42, 38)


def regions(numbers: list[int]) -> np.ndarray:
    """Return boxes of different numbers side by side in the background [z, y, x]."""
    volume = np.zeros(SHAPE, np.int32)
    width = 36 // len(numbers)
    for place, number in enumerate(numbers):
        volume[2:18, 5:35, 1 + place * width : 1 + (place + 1) * width] = number
    return volume


def noise() -> np.ndarray:
    return np.random.default_rng(4).normal(90, 12, SHAPE)


def ramp() -> np.ndarray:
    """Return a smooth picture whose values change every fourth voxel."""
    z, y, x = np.indices(SHAPE)
    return (z + y + x) // 4 + 1


def write_nifti(path: Path, voxels: np.ndarray, intent: str = "none") -> Path:
    import nibabel

    image = nibabel.Nifti1Image(voxels.T, np.eye(4))
    image.header.set_intent(intent)
    nibabel.save(image, path)
    return path


def recognised(path: Path) -> Recognised | None:
    with open_source(SourceSpec(path=str(path)), Path("/"), Silent()) as source:
        return recognise_labels(source, path)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_flat_regions_of_whole_numbers_are_labels(tmp_path: Path, dtype: type) -> None:
    assert recognised(write_nifti(tmp_path / "a.nii", regions([3, 7, 12, 5]).astype(dtype))) is not None


@pytest.mark.parametrize(
    "voxels",
    [
        noise().astype(np.uint8),
        noise().astype(np.float32),
        ramp().astype(np.uint8),
        (regions([3, 7]) - 1).astype(np.int16),
        (regions([3, 7]) * 0.5).astype(np.float32),
        (regions([9, 9]) > 0).astype(np.uint8),
    ],
    ids=["noise", "numbers with fractions", "smooth picture", "below zero", "halves", "mask"],
)
def test_what_is_no_label_map_stays_a_picture(tmp_path: Path, voxels: np.ndarray) -> None:
    assert recognised(write_nifti(tmp_path / "a.nii", voxels)) is None


@pytest.mark.parametrize("greatest", [3, 2**17])
def test_a_large_slice_is_counted_in_strips(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, greatest: int) -> None:
    def sample() -> _Sample:
        with open_source(SourceSpec(path=str(path)), Path("/"), Silent()) as source:
            found = _sampled(source, to_the_end=True)
        assert found is not None
        return found

    voxels = np.random.default_rng(3).choice([0, 1, 2, greatest], (2, 31, 7)).astype(np.float32)
    path = write_nifti(tmp_path / "a.nii", voxels)
    whole = sample()
    assert whole.voxels[greatest] == np.count_nonzero(voxels == greatest)
    assert sum(whole.pairs.values()) == np.count_nonzero(voxels[:, :-1]) + np.count_nonzero(voxels[:, :, :-1])
    monkeypatch.setattr("volprep.scan.label_map._VOXELS_AT_ONCE", 30)
    assert sample() == whole


def test_the_intent_label_of_nifti_counts_also_for_one_region(tmp_path: Path) -> None:
    found = recognised(write_nifti(tmp_path / "a.nii.gz", regions([5]).astype(np.uint8), "label"))
    assert found is not None
    assert "intent" in found.reason


def test_the_table_beside_a_map_gives_names_if_it_has_the_numbers(tmp_path: Path) -> None:
    path = write_nifti(tmp_path / "aal.nii", regions([1, 2]).astype(np.uint8))
    table = tmp_path / "aal.nii.txt"
    table.write_text("1 Precentral_L 2001\n2 Precentral_R 2002\n")
    assert recognised(path) == Recognised("because a table with it names its 2 numbers", str(table))
    table.write_text("101 Precentral_L 2001\n102 Precentral_R 2002\n")
    found = recognised(path)
    assert found is not None
    assert not found.table, "it is a table of other numbers"


def test_structures_of_both_sides_tell_a_map_of_freesurfer(tmp_path: Path) -> None:
    numbers = [2, 3, 41, 42, 4, 43, 10, 49, 11, 50, 12, 51]
    found = recognised(write_nifti(tmp_path / "a.nii", regions(numbers).astype(np.int16)))
    assert found is not None
    assert found.table == "freesurfer"
    found = recognised(write_nifti(tmp_path / "b.nii", regions([1, 2, 3, 4]).astype(np.int16)))
    assert found is not None
    assert not found.table, "small numbers are those of any program"


def test_a_scan_without_a_scene_says_what_it_was_recognised_as_and_how_to_undo_it(tmp_path: Path) -> None:
    path = write_nifti(tmp_path / "a.nii", regions([3, 7]).astype(np.uint8))
    scene = prepare(request_for_source(path)).scene
    assert scene.source.labels
    assert "2 whole numbers" in scene.recognised
    assert "--no-labels" in scene.recognised
    undone = prepare(request_for_source(path).with_source(labels=False)).scene
    assert not undone.source.labels
    assert undone.recognised == ""


def test_a_scan_of_few_values_beside_its_segments_is_no_label_map(tmp_path: Path) -> None:
    path = write_nifti(tmp_path / "a.nii", regions([3, 7]).astype(np.uint8))
    assert not prepare(request_for_source(path).with_segments(path)).scene.source.labels


def test_labels_are_recognised_with_a_preset_too(tmp_path: Path) -> None:
    request = request_for_source(write_nifti(tmp_path / "a.nii", regions([3, 7]).astype(np.uint8)))
    scene = prepare(request.with_preset("mr-head")).scene
    assert scene.source.labels
    assert "--no-labels" in scene.recognised
    assert not prepare(request.with_source(labels=False).with_preset("mr-head")).scene.source.labels
    with pytest.raises(VolprepError) as refused:
        build(request.with_preset("mr-head-photograph"), tmp_path / "a.volpkg", Silent())
    assert refused.value.code == "VP3240"


def test_the_preset_of_labels_makes_voxels_labels(tmp_path: Path) -> None:
    path = write_nifti(tmp_path / "a.nii", noise().astype(np.uint8))
    request = request_for_source(path)
    assert prepare(request.with_preset("labels")).scene.source.labels
    assert not prepare(request.with_source(labels=False).with_preset("labels")).scene.source.labels


@pytest.mark.parametrize("kind", ["labels", "picture"])
def test_a_package_of_labels_is_a_label_map_and_no_other(tmp_path: Path, kind: str) -> None:
    numbers = regions([1, 2, 3]).astype(np.uint8)
    path = write_nifti(tmp_path / "a.nii", numbers)
    request = request_for_source(path).with_source(labels=kind == "labels").with_preset("micro-ct")
    build(request, tmp_path / "a.volpkg", Silent())
    assert (recognised(tmp_path / "a.volpkg") is not None) == (kind == "labels")

"""A rule file: each scan of a tree matches one rule, or nothing begins."""

import json
from pathlib import Path

import nibabel
import numpy as np
import pytest
from batch_scans import write_scans
from command_line import volprep
from dicom_files import save_all, stack
from phantom_scene import write_phantom_scene

from volprep.batch.estimate import Rates, rates_of
from volprep.batch.jobs import Defaults, Job
from volprep.batch.place import Place
from volprep.batch.records import JobRecord
from volprep.batch.rules import read_rules
from volprep.batch.run import find_jobs
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent

DIGEST = "0" * 64


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A CT series of a head, an MR series, and a NIfTI file with slices 2 mm apart."""
    folder = tmp_path / "tree"
    write_scans(folder, 1)
    for number, (modality, description) in enumerate((("CT", "Head CANARY 1.0"), ("MR", "t1 spine"))):
        series = stack(5)
        for image in series:
            image.SeriesInstanceUID = f"1.2.3.{number}"
            image.Modality = modality
            image.SeriesDescription = description
        save_all(series, folder / modality)
    write_phantom_scene(tmp_path)
    return folder


def rule_file(tmp_path: Path, text: str) -> Path:
    (tmp_path / "rules.toml").write_text(text, encoding="utf-8")
    return tmp_path / "rules.toml"


def jobs(tree: Path, rules: Path) -> dict[str, Job]:
    found = find_jobs(tree, Place(tree.parent / "out"), Defaults(), Silent(), rules)
    return {job.shown_source.removeprefix(f"{tree}/"): job for job in found}


ALL = """
[[rule]]
name = "heads"
modality = "CT"
description = "^head"
scene = "phantom.toml"
profiles = ["gles3", "gles2-2048"]

[[rule]]
name = "files"
format = ["nifti", "nrrd"]
"""


def test_each_scan_gets_the_scene_and_the_profiles_of_its_rule(tree, tmp_path) -> None:
    found = find_jobs(
        tree, Place(tmp_path / "out"), Defaults(), Silent(), rule_file(tmp_path, ALL + "[otherwise]\nskip = true")
    )
    assert sorted((job.rule, job.profile, job.request.scene.transfer[0].name) for job in found) == [
        ("files", "gles3", "grey"),
        ("heads", "gles2-2048", "shell"),
        ("heads", "gles3", "shell"),
    ]


def test_a_scan_that_no_rule_matches_is_said_before_anything_runs(tree, tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"VP8041 .*1 of 3 scans match no rule, and 0 match several") as refused:
        jobs(tree, rule_file(tmp_path, ALL))
    assert "MR: none; dicom, MR, 5 slices" in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_a_scan_that_two_rules_match_is_said_with_both(tree, tmp_path) -> None:
    more = '[[rule]]\nname = "many"\nslices = [5, 5]\n[otherwise]\nskip = true\n'
    with pytest.raises(VolprepError, match="1 match several") as refused:
        jobs(tree, rule_file(tmp_path, ALL + more))
    assert "CT: several: heads, many" in str(refused.value)


@pytest.mark.parametrize(
    ("condition", "matched"),
    [
        ('modality = ["PT", "MR"]', {"MR"}),
        ('description = "SPINE$"', {"MR"}),
        ("spacing_mm = [1.9, 2.1]", {"place-0/scan.nii"}),
        ('format = "dicom"', {"CT", "MR"}),
        ("slices = [6, 100]", {"place-0/scan.nii"}),
        ('modality = "CT"\nslices = [6, 100]', set()),
    ],
)
def test_a_rule_matches_where_all_of_its_conditions_hold(tree, tmp_path, condition, matched) -> None:
    rules = rule_file(tmp_path, f'[[rule]]\nname = "a"\n{condition}\n[otherwise]\n')
    assert {source for source, job in jobs(tree, rules).items() if job.rule == "a"} == matched


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[rule]]\nname = "a"\n', "VP8040 .*without a condition"),
        ('[[rule]]\nname = "a"\ncolour = "red"\n', "VP8040 .*colour: unknown key"),
        ('[[rule]]\nname = "a"\ndescription = "("\n', "VP8040 .*no regular expression"),
        ('[[rule]]\nname = "a"\nslices = [9, 1]\n', "VP8040 .*9 is larger than 1"),
        ('[[rule]]\nname = "a"\nformat = "word"\n', "VP8040 .*format"),
        ('[[rule]]\nname = "a"\nmodality = "CT"\nscene = "no.toml"\n', r"VP8042 .*no\.toml does not exist"),
        ('[[rule]]\nname = "a"\nmodality = "CT"\n' * 2, "VP8040 .*same name"),
        ('[[rule]]\nname = "a"\nmodality = "CT"\nskip = true\nscene = "x"\n', "VP8040 .*skip"),
        ("rule = 1\n[", "VP8040"),
        ("", "VP8040 .*rule: is missing"),
    ],
)
def test_a_wrong_rule_file_is_refused(tmp_path, text, said) -> None:
    with pytest.raises(VolprepError, match=said):
        read_rules(rule_file(tmp_path, text))


def test_a_rule_file_that_is_not_there_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"VP8040 .*No such file"):
        read_rules(tmp_path / "rules.toml")


def test_a_dry_run_shows_rules_and_estimates_and_then_what_matches_none(tree, tmp_path) -> None:
    arguments = ("batch", tree, "-o", tmp_path / "out", "--rules", rule_file(tmp_path, ALL), "--dry-run", "--json")
    shown = volprep(*arguments)
    assert shown.returncode == 4
    assert "VP8041" in shown.stderr
    rows = json.loads(shown.stdout)["jobs"]
    assert [row["rule"] for row in rows] == ["heads", "heads", "files", "none"]
    assert rows[2]["seconds"] == pytest.approx(0.3 + 6e-7 * 12 * 11 * 13, abs=0.01)
    assert rows[3]["name"] is None
    assert "CANARY" not in shown.stdout + shown.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == [".batch"]


def test_an_estimate_follows_what_the_ledger_has_measured() -> None:
    plain = Rates().of(10**6, 1e9)
    record = JobRecord(
        name="a",
        profile="gles3",
        outcome="built",
        source_stamp=DIGEST,
        scene_sha256=DIGEST,
        version="1",
        ended="now",
        shape_zyx=(100, 100, 100),
        seconds=3 * plain.seconds,
        size_bytes=round(2 * plain.size_bytes),
    )
    rates = rates_of([record, record.model_copy(update={"outcome": "failed", "seconds": 1e6})])
    assert set(rates) == {"gles3"}
    measured = rates["gles3"].of(10**6, 1e9)
    assert measured.seconds == pytest.approx(3 * plain.seconds)
    assert measured.size_bytes == pytest.approx(2 * plain.size_bytes, rel=1e-5)
    assert rates["gles3"].measured == 1


def test_a_scan_whose_header_is_damaged_is_matched_by_its_format(tmp_path) -> None:
    (tmp_path / "tree").mkdir()
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4, 4), "<i2"), np.eye(4)), tmp_path / "tree" / "a.nii")
    content = bytearray((tmp_path / "tree" / "a.nii").read_bytes())
    content[40:42] = b"\xff\xff"
    (tmp_path / "tree" / "a.nii").write_bytes(content)
    rules = rule_file(tmp_path, '[[rule]]\nname = "a"\nformat = "nifti"\n')
    assert jobs(tmp_path / "tree", rules)["a.nii"].voxels is None

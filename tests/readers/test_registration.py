"""Registrations in files of other programs: each is the map that the program means, or is refused."""

from pathlib import Path

import nibabel
import numpy as np
import pydicom
import pytest
import SimpleITK
from pet_ct import write_ct, write_pet
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian
from two_grids import write_two_grids

from volprep.scene.request import load_request, request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.registration import registration
from volprep_formats.source import SourceSpec

ROWS = np.array([[0.96, -0.28, 0.0, 12.0], [0.28, 0.96, 0.05, -7.0], [0.0, 0.02, 1.1, 3.0], [0.0, 0.0, 0.0, 1.0]])
"""From the moving scan to the fixed one, with a shear."""
RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
SPATIAL_REGISTRATION = "1.2.840.10008.5.1.4.1.1.66.1"


def nifti(path, affine, shape=(5, 6, 7)) -> SourceSpec:
    nibabel.save(nibabel.Nifti1Image(np.zeros(shape, np.int16), affine), path)
    return SourceSpec(path=str(path))


@pytest.fixture
def pair(tmp_path) -> tuple[SourceSpec, SourceSpec]:
    """The moving scan, whose voxels are left-handed, and the fixed one, whose voxels are right-handed."""
    moving = nifti(tmp_path / "moving.nii", np.array([[-2.0, 0, 0, 9], [0, 2.5, 0, -3], [0, 0, 4, 1], [0, 0, 0, 1]]))
    fixed = nifti(tmp_path / "fixed.nii", np.array([[0, -1.0, 0, 5], [1.5, 0, 0, 2], [0, 0, 3, -8], [0, 0, 0, 1]]))
    return moving, fixed


def read(path, moving, fixed) -> np.ndarray:
    return np.array(registration(path, moving, fixed, Silent()))


@pytest.mark.parametrize("ending", ["tfm", "txt", "h5", "mat"])
def test_itk_writes_the_map_of_resampling_which_goes_the_other_way(tmp_path, pair, ending) -> None:
    back = np.linalg.inv(ROWS)
    affine = SimpleITK.AffineTransform(3)
    affine.SetMatrix(back[:3, :3].ravel().tolist())
    # The centre of a rotation moves what the file says, not the map.
    affine.SetCenter((10.0, -20.0, 5.0))
    centre = np.array([10.0, -20.0, 5.0])
    affine.SetTranslation((back[:3, 3] - centre + back[:3, :3] @ centre).tolist())
    path = tmp_path / f"onto.{ending}"
    SimpleITK.WriteTransform(affine, str(path))
    assert read(path, *pair) == pytest.approx(ROWS[:3], abs=1e-9)


def test_a_rigid_transform_of_itk_is_read(tmp_path, pair) -> None:
    euler = SimpleITK.Euler3DTransform((1.0, 2.0, 3.0), 0.1, -0.2, 0.3, (4.0, 5.0, 6.0))
    SimpleITK.WriteTransform(euler, str(tmp_path / "rigid.tfm"))
    found = np.vstack([read(tmp_path / "rigid.tfm", *pair), [0, 0, 0, 1]])
    place = np.array([30.0, -10.0, 20.0])
    assert (found @ [*euler.TransformPoint(place.tolist()), 1.0])[:3] == pytest.approx(place, abs=1e-9)


def test_a_matrix_of_flirt_is_in_voxels_whose_x_may_run_back(tmp_path, pair) -> None:
    images = [nibabel.load(spec.path) for spec in pair]
    counted = []
    for image in images:
        scales = np.diag([*image.header.get_zooms(), 1.0])
        if np.linalg.det(image.affine) > 0:
            flip = np.diag([-1.0, 1.0, 1.0, 1.0])
            flip[0, 3] = image.shape[0] - 1
            scales = scales @ flip
        counted.append(image.affine @ np.linalg.inv(scales))
    in_ras = RAS @ ROWS @ RAS
    flirt = np.linalg.inv(counted[1]) @ in_ras @ counted[0]
    path = tmp_path / "onto.mat"
    path.write_text("\n".join("  ".join(f"{number:.12f}" for number in row) for row in flirt) + "\n")
    assert [np.linalg.det(image.affine) > 0 for image in images] == [False, True]
    assert read(path, *pair) == pytest.approx(ROWS[:3], abs=1e-5)


def spatial_registration(path, matrices: dict[str, np.ndarray]) -> None:
    data = Dataset()
    data.SOPClassUID, data.SOPInstanceUID = SPATIAL_REGISTRATION, "1.2.3.4"
    data.Modality, data.FrameOfReferenceUID = "REG", "1.9.9"
    data.RegistrationSequence = []
    for uid, matrix in matrices.items():
        item, inner, last = Dataset(), Dataset(), Dataset()
        last.FrameOfReferenceTransformationMatrix = [f"{number:.12g}" for number in matrix.ravel()]
        inner.MatrixSequence = [last]
        item.FrameOfReferenceUID, item.MatrixRegistrationSequence = uid, [inner]
        data.RegistrationSequence.append(item)
    data.file_meta = FileMetaDataset()
    data.file_meta.MediaStorageSOPClassUID, data.file_meta.MediaStorageSOPInstanceUID = SPATIAL_REGISTRATION, "1.2.3.4"
    data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    pydicom.dcmwrite(path, data, enforce_file_format=True)


def test_a_dicom_object_has_a_matrix_for_each_frame_of_reference(tmp_path) -> None:
    moving = SourceSpec(path=str(write_pet(tmp_path / "pet", "1.2.7")))
    fixed = SourceSpec(path=str(write_ct(tmp_path / "ct")))
    common = np.eye(4)
    common[:3, 3] = 5.0, -6.0, 7.0
    (frame,) = {pydicom.dcmread(path).FrameOfReferenceUID for path in (tmp_path / "ct").iterdir()}
    spatial_registration(tmp_path / "reg.dcm", {frame: common, "1.2.7": common @ ROWS})
    assert read(tmp_path / "reg.dcm", moving, fixed) == pytest.approx(ROWS[:3], abs=1e-9)
    spatial_registration(tmp_path / "other.dcm", {frame: common})
    with pytest.raises(VolprepError, match=r"VP1247.*…1\.2\.7"):
        read(tmp_path / "other.dcm", moving, fixed)


def test_a_scene_and_the_command_line_name_a_file_and_keep_its_matrix(tmp_path, pair) -> None:
    shift = SimpleITK.TranslationTransform(3, (-7.0, 4.0, -3.0))
    SimpleITK.WriteTransform(shift, str(tmp_path / "onto.tfm"))
    expected = ((1.0, 0.0, 0.0, 7.0), (0.0, 1.0, 0.0, -4.0), (0.0, 0.0, 1.0, 3.0))
    scene = write_two_grids(tmp_path, pet='transform = "onto.tfm"')
    ct = request_for_source(Path(pair[1].path))
    for request in (load_request(scene), ct.with_veil(Path(pair[0].path), tmp_path / "onto.tfm")):
        _, veil = request.scene.source.channels
        assert veil.affine == expected
        assert "onto.tfm" not in request.scene.model_dump_json()


def test_what_is_no_affine_map_is_refused_with_the_reason(tmp_path, pair) -> None:
    field = SimpleITK.DisplacementFieldTransform(3)
    field.SetDisplacementField(SimpleITK.Image([4, 4, 4], SimpleITK.sitkVectorFloat64, 3))
    SimpleITK.WriteTransform(field, str(tmp_path / "warp.h5"))
    (tmp_path / "words.tfm").write_text("not a transform\n")
    (tmp_path / "flat.mat").write_text("1 0 0 0\n0 1 0 0\n0 0 0 0\n0 0 0 1\n")
    raw = SourceSpec(path=pair[0].path, format="nifti")
    for name, reason in {
        "warp.h5": "no affine map",
        "words.tfm": "ITK cannot read",
        "flat.mat": "no inverse",
        "none.tfm": "No such file",
    }.items():
        with pytest.raises(VolprepError, match=rf"VP1247.*{reason}"):
            registration(tmp_path / name, raw, pair[1], Silent())

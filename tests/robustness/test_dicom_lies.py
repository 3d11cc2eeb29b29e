"""Files that contradict themselves, of every kind: each is refused with a code, or read as what it was made from."""

import numpy as np
import pytest
from dicom_files import image, save

from .dicom_lies import LIES, Lie, lie_outcome, lie_outcomes

pytestmark = pytest.mark.usefixtures("kept_workers")


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("lie", LIES, ids=lambda lie: lie.name)
def test_a_file_that_contradicts_itself_is_refused_or_read_as_what_it_was_made_from(lie, tmp_path) -> None:
    outcomes = lie_outcomes(lie, tmp_path, count=60, seed=3)
    assert sum(count for name, count in outcomes.items() if name != "read") > 40, outcomes
    assert not {"VP1270", "VP1271", "VP1272", "VP1273"} & outcomes.keys(), "a decoder went wrong"


def test_a_lie_that_is_believed_fails_with_its_case(tmp_path) -> None:
    def believed(file, chance) -> np.ndarray:
        pixels = chance.integers(0, 99, (4, 5)).astype(np.uint8)
        save(image(pixels + 1, SliceThickness="1"), file)
        return pixels

    with pytest.raises(AssertionError, match="believed case 7 of seed 5 ended in AssertionError: read as other values"):
        lie_outcome(Lie("believed", believed), tmp_path / "lie", 5, 7)

"""A page draws the packages in formats/samples as their pictures say."""

import pytest
from format_samples import LARGEST, SAMPLES, differing
from web_pictures import drawn_in_page

from volprep.truth.picture import encoded
from volprep_formats.package.reader import Package

WITHOUT_SHADERS = "slices"


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", sorted(set(SAMPLES) - {WITHOUT_SHADERS}))
def test_a_page_draws_the_picture_of_a_sample(browser, server, name) -> None:
    sample = SAMPLES[name]
    kind = "webgl2" if Package.open(sample.package).manifest.profile.api == "es3.0" else "webgl"
    how = {"frame": sample.frame} if sample.point is None else {"point": sample.point}
    found = drawn_in_page(browser, server, sample.package, [sample.box_from_clip], kind=kind, **how)
    assert found.said["error"] == 0
    assert differing(encoded(found.pictures[0], "black"), sample) <= LARGEST

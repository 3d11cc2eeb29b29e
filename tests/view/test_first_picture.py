"""The first picture of a page comes with the coarsest level; `make bench` measures how soon."""

import gzip

import pytest
from first_picture import first_picture
from view_page import served

from volprep.view.site import read_served
from volprep_formats.package.reader import Package


@pytest.mark.long
def test_the_first_picture_needs_no_finer_level_and_few_bytes(browser, phantom) -> None:
    manifest = Package.open(phantom.package).manifest
    finer = [each.file for each in manifest.textures if each.role == "volume" and each.level == 0]
    assert len({each.level for each in manifest.textures if each.role == "volume"}) > 1
    with served(phantom.package) as server:
        browser.send("Network.setBlockedURLs", urls=[f"*{file}" for file in finer])
        try:
            found = first_picture(browser, server.url, 10.0)
        finally:
            browser.send("Network.setBlockedURLs", urls=[])
        own = f"/{server.token}/"
        site = server.site
    # Finer levels are asked for ahead, and the picture came although the finest cannot be had. What every package takes
    # before its first picture is a tenth of what 10 Mbit/s bring in 2 s.
    waited = {file.removeprefix(own) for file in found["files"] if file.startswith(own)} - {
        f"package/{file}" for file in finer
    }
    sent = [read_served(site[file]) for file in waited]
    assert len(sent) > 20
    assert sum(len(gzip.compress(data)) for data in sent) < 250_000

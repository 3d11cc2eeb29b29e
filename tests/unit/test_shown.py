"""Text from outside is shown in one line that a terminal cannot obey."""

import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.shown import printable, shown


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("scan 12.nii", "scan 12.nii"),
        ("Schädel-ÄÖ 頭部 ×", "Schädel-ÄÖ 頭部 ×"),
        ("a\x1b[31mb", "a\\x1b[31mb"),
        ("a\nvolprep: VP9999", "a\\nvolprep: VP9999"),
        ("a\r\t\x00\x7f\x9b", "a\\r\\t\\x00\\x7f\\x9b"),
        ("ini.\u202exfg\u2066\u200f\u2028", "ini.\\u202exfg\\u2066\\u200f\\u2028"),
        (b"caf\xe9.nii".decode("utf-8", "surrogateescape"), "caf\\xe9.nii"),
        ("\ud800", "\\ud800"),
        (12.5, "12.5"),
    ],
)
def test_what_a_terminal_would_obey_is_escaped_and_the_rest_stays(text, expected) -> None:
    assert shown(text) == expected


def test_long_text_keeps_its_beginning_and_its_end() -> None:
    cut = shown("/data/" + "x" * 5000 + "/slice.dcm", 100)
    assert len(cut) == 100
    assert cut.startswith("/data/x")
    assert cut.endswith("x/slice.dcm")
    assert "…" in cut


def test_text_is_cut_after_it_was_escaped() -> None:
    assert len(shown("\x1b" * 300)) == 400


def test_everything_that_is_shown_can_be_encoded_as_utf_8_and_is_printable() -> None:
    text = "".join(map(chr, range(0x11000)))
    safe = shown(text, 10**7)
    assert safe.isprintable()
    assert safe.encode("utf-8")


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("http://user:SECRET@host/scan.nii", "http://***@host/scan.nii"),
        ("https://user:SE@CRET@host:99/a b.nii", "https://***@host:99/a b.nii"),
        ("s3://bucket/scan?X-Amz-Signature=SECRET&X-Amz-Date=1", "s3://bucket/scan?***"),
        ("cannot get https://h/x?sig=SECRET, status 403", "cannot get https://h/x?*** status 403"),
        ("url=URL('https://u:SECRET@h/x?sig=SECRET')", "url=URL('https://***@h/x?***')"),
        ("https://host/scan#SECRET", "https://host/scan?***"),
        ("/home/me/https:/user:SECRET@host/scan.nii?SECRET", "/home/me/https:/***@host/scan.nii?***"),
        ("https://host/scan.nii and /a/b@c?d", "https://host/scan.nii and /a/b@c?d"),
    ],
)
def test_secrets_of_addresses_are_never_shown(address: str, told: str) -> None:
    assert printable(address) == told
    error = VolprepError("VP1001", path=address)
    assert "SECRET" not in str(error) + error.summary
    assert "SECRET" not in str(VolprepError("VP8050", path=address, times=3, error=address))

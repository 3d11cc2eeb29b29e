"""The server of the page: who may read, what may be read, and how much may be sent."""

import gzip
import http.client
import json
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import pytest
from command_line import COMMAND
from device_files import device_record_text

from volprep.view import server as view_server
from volprep.view.ranges import UnsatisfiableError, part_of
from volprep.view.server import ViewServer, lan_address, qr_code
from volprep.view.site import file_served, text_served
from volprep_formats.diagnostics import VolprepError
from volprep_formats.runtime import sent_modules

DIGEST = "a" * 64
BIG = bytes(range(256)) * 1000


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("served")
    (folder / "big.ktx2").write_bytes(BIG)
    (folder.parent / "secret.txt").write_text("not for you")
    return folder


@pytest.fixture(scope="module")
def server(folder) -> Iterator[ViewServer]:
    site = {
        "index.html": text_served("<!DOCTYPE html>page", "index.html"),
        "runtime/core.js": text_served(sent_modules()["core.js"], "core.js"),
        "package/a/big.ktx2": file_served(folder / "big.ktx2"),
    }
    with ViewServer(site, DIGEST, devices=folder / "devices") as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def ask(server: ViewServer, path: str, method: str = "GET", body: bytes | None = None, **headers: str):
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)) as connection:
        connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer, answer.read()


def test_it_listens_on_this_machine_alone(server) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.server_port}/{server.token}/"


def test_the_page_is_behind_its_token_and_nothing_is_in_front_of_it(server) -> None:
    answer, body = ask(server, f"/{server.token}/")
    assert (answer.status, body) == (200, b"<!DOCTYPE html>page")
    wrong = server.token[:-1] + ("A" if server.token[-1] != "A" else "B")
    for path in ("/", "/index.html", f"/{wrong}/", f"/{server.token}", "//", f"/{server.token.upper()}x/", "*"):
        assert ask(server, path)[0].status in {400, 404}, path
    assert len(server.token) >= 22


@pytest.mark.parametrize("header", ["evil.example", "evil.example:{port}", "127.0.0.1:1", "", "127.0.0.1:{port}.evil"])
def test_a_request_that_names_another_host_is_refused(server, header) -> None:
    answer, body = ask(server, f"/{server.token}/", Host=header.format(port=server.server_port))
    assert answer.status == 421
    assert b"page" not in body


def test_two_hosts_or_none_are_refused(server) -> None:
    for lines in (b"", b"Host: 127.0.0.1:%d\r\nHost: evil\r\n" % server.server_port):
        with socket.create_connection(("127.0.0.1", server.server_port), 5) as raw:
            raw.sendall(b"GET /%s/ HTTP/1.1\r\n%sConnection: close\r\n\r\n" % (server.token.encode(), lines))
            assert b" 421 " in raw.makefile("rb").readline()


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
def test_a_request_of_another_page_is_refused(server, headers) -> None:
    assert ask(server, f"/{server.token}/package/a/big.ktx2", **headers)[0].status == 403
    posted = ask(server, f"/{server.token}/devices", "POST", b"{}", Content_Type="application/json", **headers)
    assert posted[0].status == 403


def test_a_link_in_a_mail_opens_the_page(server) -> None:
    answer, _ = ask(server, f"/{server.token}/", Sec_Fetch_Site="cross-site", Sec_Fetch_Dest="document")
    assert answer.status == 200


@pytest.mark.parametrize(
    "path",
    [
        "../secret.txt",
        "package/../../secret.txt",
        "%2e%2e/secret.txt",
        "package/a/../../../secret.txt",
        "package//a/big.ktx2",
        "/etc/passwd",
        "package/a",
        "package/a/big.ktx2/",
        "index.html\\..\\secret.txt",
        "package/a/big.ktx2%00",
    ],
)
def test_no_address_leads_out_of_what_is_served(server, path) -> None:
    answer, body = ask(server, f"/{server.token}/{path}")
    assert answer.status == 404
    assert b"secret" not in body
    assert b"not for you" not in body


def test_headers_forbid_all_other_origins(server) -> None:
    for path in (f"/{server.token}/", "/nothing"):
        answer, _ = ask(server, path)
        policy = dict(part.strip().split(" ", 1) for part in answer.headers["Content-Security-Policy"].split(";"))
        assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
        assert policy["script-src"] == policy["connect-src"] == policy["style-src"] == "'self'"
        assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert answer.headers["Cross-Origin-Opener-Policy"] == "same-origin"
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert answer.headers["Cache-Control"] == "no-store"
        assert "Access-Control-Allow-Origin" not in answer.headers
        assert "Python" not in answer.headers["Server"]


@pytest.mark.parametrize(
    ("header", "start", "stop"),
    [
        ("bytes=0-0", 0, 1),
        ("bytes=100-199", 100, 200),
        ("bytes=255000-", 255_000, 256_000),
        ("bytes=-7", 255_993, 256_000),
    ],
)
def test_a_part_of_a_file_is_sent_alone(server, header, start, stop) -> None:
    answer, body = ask(server, f"/{server.token}/package/a/big.ktx2", Range=header)
    assert answer.status == 206
    assert body == BIG[start:stop]
    assert answer.headers["Content-Range"] == f"bytes {start}-{stop - 1}/{len(BIG)}"


def test_scripts_are_sent_packed_to_who_takes_that_and_textures_never(server) -> None:
    path = f"/{server.token}/runtime/core.js"
    answer, packed = ask(server, path, Accept_Encoding="gzip, br")
    assert (answer.status, answer.headers["Content-Encoding"]) == (200, "gzip")
    assert len(packed) == int(answer.headers["Content-Length"]) < 21_500  # as tests/js/test_size.py has it
    plain, whole = ask(server, path)
    assert plain.headers["Content-Encoding"] is None
    assert gzip.decompress(packed) == whole == sent_modules()["core.js"].encode()
    _, part = ask(server, path, Accept_Encoding="gzip", Range="bytes=5-9")
    assert part == whole[5:10]
    big, body = ask(server, f"/{server.token}/package/a/big.ktx2", Accept_Encoding="gzip")
    assert (big.headers["Content-Encoding"], body) == (None, BIG)


def test_a_part_beyond_the_file_is_refused_with_its_size(server) -> None:
    answer, body = ask(server, f"/{server.token}/package/a/big.ktx2", Range="bytes=256000-")
    assert (answer.status, answer.headers["Content-Range"], body) == (416, "bytes */256000", b"")


def test_a_head_has_no_body_and_the_size_of_the_file(server) -> None:
    answer, body = ask(server, f"/{server.token}/package/a/big.ktx2", "HEAD")
    assert (answer.status, answer.headers["Content-Length"], body) == (200, str(len(BIG)), b"")
    assert answer.headers["Accept-Ranges"] == "bytes"


@pytest.mark.parametrize(
    ("header", "size", "part"),
    [
        (None, 10, None),
        ("bytes=-", 10, None),
        ("bytes=5-2", 10, None),
        ("bytes=0-1,3-4", 10, None),
        ("lines=0-1", 10, None),
        ("bytes=3-99", 10, (3, 10)),
        ("bytes=-99", 10, (0, 10)),
    ],
)
def test_ranges_that_are_none_are_ignored_and_long_ones_cut(header, size, part) -> None:
    assert part_of(header, size) == part


@pytest.mark.parametrize(("header", "size"), [("bytes=10-", 10), ("bytes=-0", 10), ("bytes=0-", 0)])
def test_an_empty_range_cannot_be_had(header, size) -> None:
    with pytest.raises(UnsatisfiableError):
        part_of(header, size)


def test_other_methods_are_refused(server) -> None:
    for method in ("PUT", "DELETE", "OPTIONS", "TRACE"):
        assert ask(server, f"/{server.token}/", method)[0].status == 501
    assert ask(server, f"/{server.token}/index.html", "POST", b"{}")[0].status == 405


def post(server, body: bytes, content_type: str = "application/json"):
    answer, told = ask(server, f"/{server.token}/devices", "POST", body, Content_Type=content_type)
    return answer.status, told


def test_a_measurement_is_stored_once_and_told_of(server, folder) -> None:
    told = []
    server.received = lambda path, record: told.append((path, record))
    body = device_record_text(manifest_sha256=DIGEST).encode()
    status, answer = post(server, body)
    assert status == 201
    assert post(server, body)[0] == 201
    (stored,) = (folder / "devices").iterdir()
    assert json.loads(answer) == {"file": stored.name}
    assert json.loads(stored.read_text()) == json.loads(body)
    assert [path for path, _ in told] == [stored, stored]


def test_what_is_no_measurement_is_refused_with_a_code(server) -> None:
    for body in (b"", b"{", b"[]", b'{"format": "volprep-device"}', b"\xff", device_record_text(extra=1).encode()):
        status, answer = post(server, body)
        assert (status, json.loads(answer)["code"]) == (400, "VP7036")


def test_a_measurement_of_another_package_is_refused(server) -> None:
    status, answer = post(server, device_record_text(manifest_sha256="b" * 64).encode())
    assert (status, json.loads(answer)["code"]) == (400, "VP7037")


def test_a_measurement_that_is_too_large_is_refused_before_it_is_read(server) -> None:
    with socket.create_connection(("127.0.0.1", server.server_port), 5) as raw:
        raw.sendall(
            b"POST /%s/devices HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Type: application/json\r\n"
            b"Content-Length: 999999999\r\n\r\n" % (server.token.encode(), server.server_port)
        )
        assert b" 413 " in raw.makefile("rb").readline()


def test_a_body_without_a_length_or_of_another_kind_is_refused(server) -> None:
    assert post(server, b"{}", "text/plain")[0] == 415
    answer, _ = ask(
        server, f"/{server.token}/devices", "POST", None, Content_Type="application/json", Content_Length="+5"
    )
    assert answer.status == 411


def test_one_sender_stores_only_so_many_measurements_and_others_still_can(server, monkeypatch) -> None:
    monkeypatch.setattr(view_server, "_MOST_MEASUREMENTS", server._measurements["127.0.0.1"] + 2)
    body = device_record_text(manifest_sha256=DIGEST).encode()
    assert [post(server, body)[0] for _ in range(3)] == [201, 201, 400]
    assert json.loads(post(server, body)[1])["code"] == "VP7072"
    server.require_room(("10.0.0.7", 1))


def test_a_request_that_comes_too_slowly_is_cut_off(server, monkeypatch) -> None:
    monkeypatch.setattr(view_server, "_REQUEST_S", 0.3)
    with socket.create_connection(("127.0.0.1", server.server_port), 5) as raw:
        began = time.monotonic()
        with suppress(ConnectionError):
            while time.monotonic() - began < 4:
                raw.sendall(b"G")
                time.sleep(0.05)
        assert time.monotonic() - began < 3


def test_a_body_that_comes_too_slowly_is_cut_off(server, monkeypatch) -> None:
    monkeypatch.setattr(view_server, "_REQUEST_S", 0.3)
    with socket.create_connection(("127.0.0.1", server.server_port), 5) as raw:
        head = f"POST /{server.token}/devices HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\n"
        raw.sendall(f"{head}Content-Type: application/json\r\nContent-Length: 99\r\n\r\n".encode())
        began = time.monotonic()
        assert b"201" not in raw.makefile("rb").read()
        assert time.monotonic() - began < 3


def test_one_sender_has_only_so_many_connections(server, monkeypatch) -> None:
    monkeypatch.setattr(view_server, "_MOST_CONNECTIONS", 3)
    with ExitStack() as stack:
        for _ in range(3):
            stack.enter_context(socket.create_connection(("127.0.0.1", server.server_port), 5))
        time.sleep(0.2)
        fourth = stack.enter_context(socket.create_connection(("127.0.0.1", server.server_port), 5))
        with suppress(ConnectionError):
            assert fourth.recv(1) == b""
    time.sleep(0.2)
    assert ask(server, f"/{server.token}/")[0].status == 200


def test_a_port_that_is_taken_is_told_of(server) -> None:
    with pytest.raises(VolprepError, match=f"VP7031 .*port {server.server_port}"):
        ViewServer({}, DIGEST, port=server.server_port)


def test_the_code_for_phones_is_blocks_and_the_address_in_the_network_is_no_loopback() -> None:
    lines = qr_code("http://192.168.178.20:40123/AbCdEfGhIjKlMnOpQrStUv/").splitlines()
    assert len(lines) > 12
    assert set("".join(lines)) <= set(" \u2580\u2584\u2588")
    try:
        address = lan_address()
    except VolprepError as error:
        assert error.code == "VP7032"  # noqa: PT017 - a machine without a network
    else:
        assert not address.startswith("127.")


def test_the_verb_serves_until_it_is_interrupted_and_ends_without_a_word_of_trouble(phantom) -> None:
    command = [*COMMAND, "view", str(phantom.package), "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        url = running.stdout.readline().strip()
        with closing(http.client.HTTPConnection(url.split("/")[2], timeout=20)) as connection:
            connection.request("GET", f"/{url.split('/')[3]}/view.json")
            settings = json.load(connection.getresponse())
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=20)
    assert url.startswith("http://127.0.0.1:")
    assert settings["devices"] is None
    assert settings["report"] == "report/report.json"
    assert (running.returncode, err) == (0, "")
    assert out.endswith("ended\n")

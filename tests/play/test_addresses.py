"""Other addresses than this machine's own: only with TLS, or behind a proxy that has it."""

import contextlib
import json
import re
import shutil
import socket
import ssl
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from qbumpers.errors import RequestError
from qbumpers.play.addresses import Address, is_loopback, listening_at
from qbumpers.play.prompt import REQUEST_WITHIN
from tests.play.serving import UP, process

PAGE = Path(__file__).parents[2] / "docs" / "hosting.md"
PUBLIC = "https://study.example.org"


@pytest.fixture(scope="session")
def certificate(tmp_path_factory):
    """A certificate that signs itself, of localhost, and its key."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    folder = tmp_path_factory.mktemp("tls")
    files = folder / "certificate.pem", folder / "key.pem"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
         "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
         "subjectAltName=DNS:localhost", "-out", files[0], "-keyout", files[1]],
        check=True, capture_output=True,
    )  # fmt: skip
    return files


@pytest.mark.parametrize(
    ("host", "is_one"),
    [
        ("127.0.0.1", True), ("127.9.9.9", True), ("::1", True), ("LocalHost", True),
        ("0.0.0.0", False), ("192.168.1.5", False), ("example.org", False), ("", False),
    ],
)  # fmt: skip
def test_loopback_is_this_machine_alone(host, is_one):
    assert is_loopback(host) == is_one


@pytest.mark.parametrize(
    ("address", "message"),
    [
        (Address("192.168.1.5"), "host = 192.168.1.5: that is another address than this machine's"),
        (Address("0.0.0.0"), "which needs TLS (--certificate and --key) or a proxy"),
        (Address("", public=""), "which needs TLS"),
        (Address(certificate=Path("c.pem")), "key is missing; --certificate and --key go together"),
        (Address(key=Path("k.pem")), "certificate is missing"),
        (Address(certificate=Path("c"), key=Path("k")), "certificate = c: there is no such file"),
        (Address(public="study.example.org"), "a URL such as https://study.example.org is needed"),
        (Address(public="ftp://study.example.org"), "a URL such as"),
        (Address(public="https://"), "a URL such as"),
        (Address(public="https://x:99999"), "behind-proxy = 'https://x:99999': Port out of range"),
        (Address(public="http://study.example.org"), "participants' pages need https"),
        (Address(public="https://example.org/study"), "a name and a port at most"),
        (Address(public="https://me@example.org"), "a name and a port at most"),
        (Address(public="https://münchen.example"), "in ASCII"),
    ],
)
def test_an_unsafe_address_is_refused_by_what_it_needs(address, message):
    with pytest.raises(RequestError, match=re.escape(message)) as refused:
        address.check()
    assert "\n" not in str(refused.value)


def test_files_that_are_no_certificate_are_refused(certificate, tmp_path):
    wrong = tmp_path / "wrong.pem"
    wrong.write_text("nonsense", encoding="utf-8")
    for one, other in [
        (wrong, certificate[1]),
        (certificate[0], wrong),
        (certificate[1], certificate[0]),
    ]:
        with pytest.raises(RequestError, match=r"a certificate and its key are needed"):
            Address("192.168.1.5", 0, one, other).check()
    locked = tmp_path / "locked.pem"
    subprocess.run(
        ["openssl", "pkey", "-in", certificate[1], "-aes128", "-passout", "pass:x", "-out", locked],
        check=True, capture_output=True,
    )  # fmt: skip
    with pytest.raises(RequestError, match="the key without a password"):
        Address("192.168.1.5", 0, certificate[0], locked).check()
    with pytest.raises(RequestError, match="every address and no name"):
        Address("0.0.0.0", 0, *certificate).check()
    Address("192.168.1.5", 0, *certificate).check()
    Address("0.0.0.0", 0, *certificate, public=PUBLIC).check()


@pytest.mark.parametrize(
    ("address", "scheme", "hosts"),
    [
        (Address(), "http", ["127.0.0.1:7", "localhost:7"]),
        (Address("localhost"), "http", ["localhost:7", "127.0.0.1:7"]),
        (Address("::1"), "http", ["[::1]:7", "localhost:7", "127.0.0.1:7"]),
        (Address("Lab.example", certificate=Path("c")), "https", ["lab.example:7"]),
        (Address("0.0.0.0", public=PUBLIC), "https", ["study.example.org"]),
        (Address(public="HTTPS://Study.Example.org:443/"), "https", ["study.example.org"]),
        (Address(public="https://study.example.org:444"), "https", ["study.example.org:444"]),
        (Address(public="http://localhost:80"), "http", ["localhost"]),
    ],
)
def test_pages_address_it_as_browsers_write_it(address, scheme, hosts):
    assert (address.scheme, address.hosts(7)) == (scheme, hosts)


def test_a_host_that_is_not_here_is_refused():
    with pytest.raises(RequestError, match=r"host = nowhere\.invalid: .*; give an address of this"):
        listening_at(0, "nowhere.invalid")
    with pytest.raises(RequestError, match=r"host = 192\.0\.2\.1, port = 0: "):
        listening_at(0, "192.0.2.1")


def trusting(certificate):
    return ssl.create_default_context(cafile=str(certificate))


def walked(url, origin, context):
    """The step that is shown after one key."""
    with connect(url, origin=Origin(origin), ssl=context) as page:
        page.send('{"type": "hello"}')
        assert json.loads(page.recv(10))["type"] == "welcome"
        page.send('{"type": "begin", "episode": 0, "assistant": "none"}')
        assert json.loads(page.recv(10))["number"] == 0
        act = {"type": "act", "number": 0, "action": UP, "device": "keyboard"}
        page.send(json.dumps({**act, "pressed": 2, "shown": 1}))
        return json.loads(page.recv(10))["number"]


def test_tls_is_spoken_with_the_certificate(certificate, tmp_path):
    arguments = ["--host", "localhost", "--certificate", str(certificate[0]), "--key",
                 str(certificate[1]), "--out", str(tmp_path)]  # fmt: skip
    with process("cliff-walking", *arguments) as server:
        assert re.fullmatch(r"localhost:\d+", server.address)
        assert server.url == f"https://{server.address}/"
        context = trusting(certificate[0])
        with urllib.request.urlopen(server.url, context=context, timeout=10) as page:
            assert b"<title>Q Bumpers</title>" in page.read()
        socket_url = f"wss://{server.address}/socket"
        assert walked(socket_url, server.url.rstrip("/"), context) == 1
        plain = Origin(f"http://{server.address}")
        with pytest.raises(InvalidStatus, match="403"):
            connect(socket_url, origin=plain, ssl=context).__enter__()


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@contextlib.contextmanager
def nginx(folder, example):
    """Debian's nginx with one server, as this user, until the end of the block."""
    binary = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")
    if binary is None:
        pytest.skip("nginx is not installed: .ci/install_browser")
    temporary = "".join(
        f"{kind}_temp_path {folder}/{kind};\n"
        for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    configuration = folder / "nginx.conf"
    configuration.write_text(
        f"pid {folder}/pid;\nerror_log {folder}/errors;\ndaemon off;\nmaster_process off;\n"
        f"events {{}}\nhttp {{\naccess_log off;\n{temporary}{example}\n}}\n",
        encoding="utf-8",
    )
    running = subprocess.Popen(
        [binary, "-p", folder, "-e", f"{folder}/errors", "-c", configuration]
    )
    try:
        yield running
    finally:
        running.terminate()
        running.wait(10)


def answers(port):
    """Wait until something listens at a port."""
    until = time.monotonic() + 10
    while time.monotonic() < until:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
            return
        time.sleep(0.05)
    raise AssertionError(f"nothing listens at port {port}")


def test_the_example_of_nginx_serves_the_page(certificate, tmp_path):
    found = re.search(r"^```nginx\n(.*?)^```$", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    assert found is not None
    public = free_port()
    arguments = ["cliff-walking", "--out", str(tmp_path / "out"), "--behind-proxy",
                 f"https://localhost:{public}"]  # fmt: skip
    port = free_port()
    with process(*arguments, port=port) as server:
        assert server.url == f"https://localhost:{public}/"
        example = found[1]
        for here, there in [
            ("listen 443 ssl", f"listen 127.0.0.1:{public} ssl"),
            ("study.example.org;", "localhost;"),
            ("/etc/ssl/study/certificate.pem", str(certificate[0])),
            ("/etc/ssl/study/key.pem", str(certificate[1])),
            ("127.0.0.1:8765", f"127.0.0.1:{port}"),
        ]:
            assert example.count(here) == 1, here
            example = example.replace(here, there)
        with nginx(tmp_path, example):
            answers(public)
            context = trusting(certificate[0])
            with urllib.request.urlopen(server.url, context=context, timeout=10) as page:
                assert "default-src 'none'" in page.headers["Content-Security-Policy"]
            address = f"wss://localhost:{public}/socket"
            assert walked(address, f"https://localhost:{public}", context) == 1
            with pytest.raises(InvalidStatus, match="403"):
                connect(address, origin=Origin("https://evil.example"), ssl=context).__enter__()
        # Past the proxy, the server is not to be had under another name.
        direct = f"http://127.0.0.1:{port}/"
        with pytest.raises(urllib.error.HTTPError, match="421"):
            urllib.request.urlopen(direct, timeout=10)


@pytest.mark.slow
def test_who_does_not_finish_the_handshake_of_tls_is_cut_off(certificate, tmp_path):
    arguments = ["--host", "localhost", "--certificate", str(certificate[0]), "--key",
                 str(certificate[1]), "--out", str(tmp_path)]  # fmt: skip
    with process("cliff-walking", *arguments) as server:
        host, port = server.address.split(":")
        with socket.create_connection((host, int(port)), 20) as connection:
            connection.settimeout(REQUEST_WITHIN + 5)
            assert connection.recv(10) == b""

"""Where a server listens, by which addresses pages reach it, and what that asks for."""

import ipaddress
import socket
import ssl
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from qbumpers.errors import RequestError

_USUAL_PORTS = {"http": 80, "https": 443}
_TLS_ALONE = (
    "that is another address than this machine's own, which needs TLS (--certificate and --key) "
    "or a proxy that has it (--behind-proxy URL)"
)


class Address(NamedTuple):
    """Where a server listens.

    Attributes:
        host: address or name; only with TLS or behind a proxy another than this machine's own.
        port: any that is free if 0.
        certificate: file of the TLS certificate and those above it; none without TLS.
        key: file of its private key.
        public: URL by which a proxy serves it, "https://study.example.org"; empty without one.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    certificate: Path | None = None
    key: Path | None = None
    public: str = ""

    @property
    def scheme(self) -> str:
        """Of the URL by which pages reach the server."""
        if self.public:
            return urlsplit(self.public).scheme
        return "https" if self.certificate else "http"

    def check(self) -> None:
        """Refuse what would be unsafe or could not be reached.

        Raises:
            RequestError: without TLS for another address than loopback; for files that are no
                certificate with its key; for a URL of a proxy that is none, or is not encrypted.
        """
        if self.public:
            _check_public(self.public)
        if (self.certificate is None) != (self.key is None):
            missing = "key" if self.key is None else "certificate"
            raise RequestError(f"{missing} is missing; --certificate and --key go together")
        if self.certificate is not None and self.key is not None:
            _check_certificate(self.certificate, self.key)
        elif not self.public and not is_loopback(self.host):
            raise RequestError(f"host = {self.host}: {_TLS_ALONE}")
        if not self.public and _is_any(self.host):
            raise RequestError(
                f"host = {self.host}: that is every address and no name; give the name by which "
                "pages reach it, or their URL as --behind-proxy"
            )

    def hosts(self, port: int) -> list[str]:
        """Names with ports by which pages address the server, the first one to be shown.

        Args:
            port: on which it listens.
        """
        if self.public:
            parts = urlsplit(self.public)
            return [_host(str(parts.hostname), parts.port, parts.scheme)]
        names = [self.host.lower()]
        if is_loopback(self.host):
            names += [name for name in ("localhost", "127.0.0.1") if name not in names]
        return [_host(name, port, self.scheme) for name in names]


def is_loopback(host: str) -> bool:
    """Whether a host is this machine, for this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def listening_at(port: int, host: str = "127.0.0.1") -> socket.socket:
    """A socket that listens already.

    Args:
        port: any that is free if 0.
        host: address of this machine, or a name of it.

    Raises:
        RequestError: if it is in use, or there is no such port or host here.
    """
    try:
        family, _, _, _, place = _place(host, port)
    except (OSError, UnicodeError) as error:
        raise RequestError(
            f"host = {host}: {_reason(error)}; give an address of this machine"
        ) from error
    listening = socket.socket(family)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(place)
    except (OSError, OverflowError) as error:
        listening.close()
        what = f"port = {port}" if is_loopback(host) else f"host = {host}, port = {port}"
        raise RequestError(
            f"{what}: {_reason(error)}; give a free one by --port, or 0 for any"
        ) from error
    listening.listen(128)
    return listening


def _place(host: str, port: int) -> Any:
    # The port is left to bind, which refuses one that is too large.
    family, kind, protocol, name, place = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0]
    return family, kind, protocol, name, (place[0], port, *place[2:])


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def _is_any(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return host == ""


def _check_public(url: str) -> None:
    wrong = f"behind-proxy = {url!r}"
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise RequestError(f"{wrong}: {error}") from error
    if parts.scheme not in _USUAL_PORTS or not host or not url.isascii() or port == 0:
        raise RequestError(f"{wrong}; a URL such as https://study.example.org is needed, in ASCII")
    if parts.path not in ("", "/") or parts.query or parts.fragment or parts.username is not None:
        raise RequestError(f"{wrong}: a name and a port at most; the page has the whole host")
    if parts.scheme == "http" and not is_loopback(host):
        raise RequestError(f"{wrong}: participants' pages need https")


def _check_certificate(certificate: Path, key: Path) -> None:
    for what, path in (("certificate", certificate), ("key", key)):
        if not path.is_file():
            raise RequestError(f"{what} = {path}: there is no such file")
    try:
        # A key with a password would ask for it at the terminal, each time.
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, lambda: "")
    except (OSError, ValueError) as error:
        raise RequestError(
            f"certificate = {certificate}, key = {key}: {_reason(error)}; a certificate "
            "and its key are needed, both in PEM, the key without a password"
        ) from error


def _host(name: str, port: int | None, scheme: str) -> str:
    """As browsers write it: without the scheme's usual port, IPv6 in brackets."""
    written = f"[{name}]" if ":" in name else name
    return written if port in (None, _USUAL_PORTS[scheme]) else f"{written}:{port}"

"""Where a Ray cluster is, and whether it can be used from here: found out in seconds."""

import socket
import subprocess
import sys
from urllib.parse import urlsplit

from qbumpers.errors import RequestError

LOCAL = "local"
"""In place of an address: a Ray of its own on this machine."""

_LISTENING, _CONNECTING = 3.0, 15.0  # seconds for a machine, and for Ray on it, to answer

_CONNECT = (
    "import sys, ray; ray.init(sys.argv[1], log_to_driver=False, logging_level='CRITICAL'); "
    "ray.shutdown()"
)


def host_and_port(address: str) -> tuple[str, int]:
    """The parts of an address.

    Args:
        address: HOST:PORT.

    Returns:
        Host and port.

    Raises:
        ValueError: if it is something else.
    """
    parts = urlsplit(f"//{address}")
    if not parts.hostname or not parts.port or parts.netloc != address or "@" in address:
        raise ValueError(f"{address!r} is not HOST:PORT")
    return parts.hostname, parts.port


def listens(host: str, port: int) -> bool:
    """Whether something answers on a port within a few seconds."""
    try:
        socket.create_connection((host, port), timeout=_LISTENING).close()
    except OSError:
        return False
    return True


def check_address(address: str) -> None:
    """Check that an address is one, and that something answers there.

    Args:
        address: HOST:PORT.

    Raises:
        RequestError: if that is not so.
    """
    if address.startswith("ray://"):
        raise RequestError(
            f"on = {address!r}: Ray Client is not supported; run on a node of the cluster, with "
            "HOST:PORT of its head node"
        )
    try:
        host, port = host_and_port(address)
    except ValueError as error:
        raise RequestError(
            f"on = {address!r}; {LOCAL!r}, or HOST:PORT of the head node of a Ray cluster is "
            "needed, for instance 10.0.0.1:6379"
        ) from error
    if not listens(host, port):
        raise unusable(address, "nothing answers there")


def check_connecting(address: str) -> None:
    """Check that another process can connect to a Ray cluster.

    Ray itself may wait for minutes for what never answers, and then end the process.

    Args:
        address: HOST:PORT.

    Raises:
        RequestError: if it cannot in time.
    """
    command = [sys.executable, "-c", _CONNECT, address]
    try:
        subprocess.run(command, capture_output=True, timeout=_CONNECTING, check=True)
    except subprocess.TimeoutExpired as error:
        reason = _reason(error.stderr) or "what answers there is no head node of Ray"
        raise unusable(address, reason) from error
    except subprocess.CalledProcessError as error:
        raise unusable(address, _reason(error.stderr) or "connecting failed") from error


def unusable(address: str, reason: str) -> RequestError:
    """An error for an address at which Ray cannot be used.

    Args:
        address: as the user gave it.
        reason: in a few words.

    Returns:
        The error, to be raised by the caller.
    """
    if address == LOCAL:
        return RequestError(f"on = {address!r}: Ray cannot be started here ({reason})")
    return RequestError(
        f"on = {address!r}: cannot use Ray there ({reason}); {LOCAL!r}, or HOST:PORT of the head "
        "node of a running Ray cluster that this machine belongs to, is needed"
    )


def _reason(said: bytes | None) -> str:
    """What is wrong, from what a process that could not connect said."""
    text = (said or b"").decode(errors="replace")
    if "InvalidAuthToken" in text:
        return "it asks for a token; set RAY_AUTH_MODE=token, with the token where Ray looks for it"
    errors = [line for line in text.splitlines() if "Error: " in line]
    return errors[-1].partition("Error: ")[2] if errors else ""

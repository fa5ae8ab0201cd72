"""Addresses that cannot be used are refused in time, with what is allowed."""

import socket
import time

import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments import addresses
from qbumpers.experiments.cluster import RayCluster


@pytest.mark.parametrize(
    "address", ["", "cluster", "cluster:", ":6379", "a:0", "a:70000", "a:b", "a:1/c", "u@a:1"]
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(RequestError, match=r"; 'local', or HOST:PORT of the head node of a Ray"):
        RayCluster(address).__enter__()


def test_ray_client_addresses_are_refused_with_another_way():
    with pytest.raises(RequestError, match=r"'ray://127\.0\.0\.1:10001': Ray Client is not supp"):
        RayCluster("ray://127.0.0.1:10001").__enter__()


def test_an_address_where_nothing_listens_fails_at_once():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    begun = time.monotonic()
    message = rf"on = '127\.0\.0\.1:{port}': cannot use Ray there \(nothing answers there\); 'local"
    with pytest.raises(RequestError, match=message):
        RayCluster(f"127.0.0.1:{port}").__enter__()
    assert time.monotonic() - begun < 5


@pytest.mark.slow
def test_an_address_where_something_else_listens_fails_in_time(monkeypatch):
    monkeypatch.setattr(addresses, "_CONNECTING", 5.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with pytest.raises(RequestError, match=r"what answers there is no head node of Ray\)"):
            RayCluster(f"127.0.0.1:{port}").__enter__()


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        (None, ""),
        (b"Traceback\n  x\nRuntimeError: Version mismatch: 2.1\nmore\n", "Version mismatch: 2.1"),
        (b"[W] InvalidAuthToken: missing\nConnectionError: failed", "it asks for a token"),
    ],
)
def test_what_ray_says_is_wrong_is_passed_on(said, reason):
    assert addresses._reason(said).startswith(reason)
    assert bool(addresses._reason(said)) == bool(reason)

"""The command line. Exit status: 0 done, 1 it failed, 2 the request was wrong."""

from qbumpers.cli import experiments, expert, listing, tuning  # noqa: F401  their commands register
from qbumpers.cli.application import application, main

__all__ = ["application", "main"]

"""The command line. Exit status: 0 done, 1 it failed, 2 the request was wrong."""

# Their commands register.
from qbumpers.cli import compare as compare
from qbumpers.cli import experiments as experiments
from qbumpers.cli import expert as expert
from qbumpers.cli import fitting as fitting
from qbumpers.cli import listing as listing
from qbumpers.cli import play as play
from qbumpers.cli import study as study
from qbumpers.cli import study_data as study_data
from qbumpers.cli import tuning as tuning
from qbumpers.cli.application import application, main

__all__ = ["application", "main"]

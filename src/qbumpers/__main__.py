"""`python -m qbumpers` is the command `qbumpers`."""

from qbumpers.cli import main

main()

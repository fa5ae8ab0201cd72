"""From results in files to measures, statistics, figures and a report."""

import contextlib
import os
import sys

if "MPLBACKEND" in os.environ and "matplotlib" not in sys.modules:
    # In a process that a notebook starts it may name a backend that is not installed there, and
    # then Matplotlib cannot be imported.
    _named = os.environ.pop("MPLBACKEND")
    try:
        import matplotlib as mpl
    finally:
        os.environ["MPLBACKEND"] = _named
    with contextlib.suppress(ValueError):
        mpl.rcParams["backend"] = _named

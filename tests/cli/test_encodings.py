"""The command line prints and draws on any machine, whatever its encoding and settings."""

import os
import subprocess
import sys

import pytest

from qbumpers.analysis.report import write_report
from tests.experiments.examples import PLAIN, contents_of, run_into

PRINTED = "α = 0.3: 5.0 ± 1.0 \N{MINUS SIGN}2\N{EN DASH}3"


@pytest.mark.parametrize(
    ("encoding", "printed"),
    [
        ("utf-8", PRINTED),
        ("ascii", "alpha = 0.3: 5.0 +- 1.0 -2-3"),
        ("latin-1", "alpha = 0.3: 5.0 ± 1.0 -2-3"),
        ("cp1252", "alpha = 0.3: 5.0 ± 1.0 -2\N{EN DASH}3"),
    ],
)
def test_what_an_encoding_lacks_is_spelt_out(encoding, printed):
    assert PRINTED.encode(encoding, "spelt-out").decode(encoding) == printed


def test_characters_that_nobody_spells_and_bytes_of_paths_stay_readable():
    assert "κ".encode("ascii", "spelt-out") == rb"\u03ba"
    assert b"caf\xe9".decode("utf-8", "surrogateescape").encode("utf-8", "spelt-out") == b"caf\xe9"


def test_a_report_is_the_same_under_hostile_settings(tmp_path):
    folder = run_into(tmp_path / "run", **PLAIN)
    write_report(folder)
    before = contents_of(folder, "figures/*")
    assert len(before) > 4
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\nimage.cmap: none such\n")
    hostile = {
        "PYTHONIOENCODING": "", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C",
        "MPLBACKEND": "module://a_notebook.backend_inline", "MATPLOTLIBRC": str(tmp_path),
    }  # fmt: skip
    finished = subprocess.run(
        [sys.executable, "-m", "qbumpers", "report", str(folder)],
        env={**os.environ, **hostile},
        capture_output=True,
        check=True,
    )
    output = finished.stdout.decode("ascii")
    assert " +- " in output
    assert "alpha = 0." in output
    assert contents_of(folder, "figures/*") == before

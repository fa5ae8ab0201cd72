"""With `NUMBA_DISABLE_JIT=1` nothing is compiled, and every number is the same."""

import json
import os
import subprocess
import sys

from tests.uncompiled import numbers


def test_without_compilation_every_number_is_the_same_to_the_bit(own_registry):
    finished = subprocess.run(
        [sys.executable, "-m", "tests.uncompiled"],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert finished.stderr == ""
    found, expected = json.loads(finished.stdout), numbers()
    assert found == expected
    assert "'return': 54.0" in found["readme"][-1]

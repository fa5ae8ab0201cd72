"""Processes begin without running the script again, and end with their pool."""

import multiprocessing
import os
import subprocess
import sys

from qbumpers.processes import process_pool, submit_unheard

SCRIPT = """
from qbumpers.processes import process_pool, submit_unheard
print("ran")
with process_pool(2, "math") as pool:
    print(*[submit_unheard(pool, pow, 2, power).result() for power in range(4)])
"""


def test_an_unguarded_script_runs_once(tmp_path):
    script = tmp_path / "unguarded.py"
    script.write_text(SCRIPT)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["ran", "1", "2", "4", "8"]


def test_processes_end_when_the_block_is_left_although_they_are_busy():
    with process_pool(1, "math") as pool:
        number = submit_unheard(pool, os.getpid).result()
        assert number != os.getpid()
        submit_unheard(pool, __import__("time").sleep, 3600)
    assert multiprocessing.active_children() == []

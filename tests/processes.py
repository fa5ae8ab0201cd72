"""The command line as its users start it: a process of its own."""

import os
import subprocess
import sys

# Wide, so that tables and messages are not broken into lines; plain, so that they are text.
ENVIRONMENT = {**os.environ, "COLUMNS": "200", "TERM": "dumb", "NO_COLOR": "1"}

# `python -m qbumpers` that hears Ctrl-C even if it is started by a background job, which does
# not, and that can be forbidden to write large files.
PROGRAM = """
import runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
largest = int(sys.argv.pop(1))
if largest:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
runpy.run_module("qbumpers", run_name="__main__", alter_sys=True)
"""


def start(*arguments, largest_file=0):
    """Start the command in its own process; `largest_file` is in bytes, 0 for any."""
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(largest_file), *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )


def finish(process):
    """Wait for a process, kill it if it hangs; its exit status, output and errors."""
    try:
        output, errors = process.communicate(timeout=300)
    finally:
        process.kill()
    return process.returncode, output, errors


def call(*arguments, largest_file=0):
    return finish(start(*arguments, largest_file=largest_file))

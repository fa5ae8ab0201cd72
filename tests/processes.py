"""The command line as its users start it: a process of its own."""

import os
import signal
import subprocess
import sys

# Wide, so that tables and messages are not broken into lines; plain, so that they are text.
ENVIRONMENT = {**os.environ, "COLUMNS": "200", "TERM": "dumb", "NO_COLOR": "1"}


def start(*arguments, prepare=lambda: None):
    """Start the command in its own process; `prepare` runs there before Python does."""

    def ready():
        # A shell's background job ignores Ctrl-C, and so would every process that it starts.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        prepare()

    return subprocess.Popen(
        [sys.executable, "-m", "qbumpers", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        preexec_fn=ready,
    )


def finish(process):
    """Wait for a process, kill it where it hangs; its exit status, output and errors."""
    try:
        output, errors = process.communicate(timeout=300)
    finally:
        process.kill()
    return process.returncode, output, errors


def call(*arguments, prepare=lambda: None):
    return finish(start(*arguments, prepare=prepare))

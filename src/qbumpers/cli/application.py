"""The command `qbumpers` as a whole: its help, its version, and how it ends."""

import contextlib
import os
import signal
import sys
import warnings
from collections.abc import Generator
from typing import Annotated, Any

import typer
from rich.text import Text
from typer.core import TyperGroup

import qbumpers
from qbumpers.cli.console import (
    ERRORS,
    OUTPUT,
    forget_warnings,
    in_one_line,
    print_in_any_encoding,
    print_warning,
)
from qbumpers.errors import RequestError


class _Commands(TyperGroup):
    """The commands; one that meets the end of a file too early says so, and is not "Aborted"."""

    def invoke(self, ctx: Any) -> Any:
        """See Click, which takes the end of a file for that of a person's typing."""
        try:
            return super().invoke(ctx)
        except EOFError as error:
            raise RuntimeError(f"a file ends too early: {error}") from error


application = typer.Typer(
    cls=_Commands,
    name="qbumpers",
    help="Assistance that lets people learn: simulate it, compare it, reproduce the paper.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@application.callback(invoke_without_command=True)
def _main_options(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    traceback: Annotated[
        bool, typer.Option("--traceback", help="Show where an unexpected error came from.")
    ] = False,
) -> None:
    if version:
        OUTPUT.print(f"qbumpers {qbumpers.__version__}")
        raise typer.Exit


def main() -> None:
    """Run the command line and exit with its status."""
    print_in_any_encoding()
    forget_warnings()
    try:
        with warnings.catch_warnings():
            warnings.showwarning = print_warning
            application()
    except RequestError as error:
        _stop(2, "error", str(error))
    except OSError as error:
        _stop(1, "failed", f"{error}; what is finished is kept")
    except Exception as error:
        if "--traceback" in sys.argv:
            raise
        reason = f"{type(error).__name__}: {in_one_line(error)}"
        _stop(1, "failed", f"{reason} (unexpected; 'qbumpers --traceback ...' shows where)")


@contextlib.contextmanager
def stoppable() -> Generator[None, None, None]:
    """End at once on Ctrl-C or SIGTERM, with a message; Typer would end without one."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    except KeyboardInterrupt:
        _say("stopped", "what is finished is kept; the same command goes on from there")
        sys.stdout.flush()
        os._exit(1)  # without waiting for threads whose cells would be thrown away
    finally:
        signal.signal(signal.SIGTERM, before)


def _stop(status: int, kind: str, message: str) -> None:
    _say(kind, message)
    sys.exit(status)


def _say(kind: str, message: str) -> None:
    ERRORS.print(Text.assemble((f"{kind}: ", "bold red"), message), soft_wrap=True)

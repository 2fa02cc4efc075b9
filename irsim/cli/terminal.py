"""What the commands irsim and irtrack share: errors as lines and exit status, options, the progress bar."""

from __future__ import annotations

import errno
import importlib
import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from time import monotonic
from typing import Annotated, Any, Protocol

import typer

from irsim.errors import InputError, IrsimError

SIGNALLED = 128
"""Exit status after a signal, as shells have it: this and the signal's number."""

INTERRUPTED = SIGNALLED + signal.SIGINT
"""After Ctrl-C."""


DRAWN_EVERY_S = 0.1
"""How often a bar is drawn at most: ten times a second, as rich itself does."""
TOLD_EVERY_S = 10.0
"""How often a line says how far it is, at most, where there is no terminal: logs stay short."""


NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What a write to a full disk raises, or beyond what somebody may have of one."""


class StoppedError(Exception):
    """Ctrl-C where there is more to say than that: raised in place of KeyboardInterrupt."""


UsageError: Any = typer.BadParameter.__base__
"""What typer raises of options and arguments; it has no public name there."""


def commands(help: str) -> typer.Typer:
    """A command of commands, all plain text, as both have it; `--version` and `--import` come before any of them."""
    return typer.Typer(
        help=help,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        add_completion=False,
        no_args_is_help=True,
        callback=first_options,
    )


def given_path(text: str | os.PathLike[str]) -> Path:
    """The path that an option or an argument says. An empty one, some script's variable that is not set, would be
    the folder where the command is given."""
    if not os.fspath(text):
        raise typer.BadParameter("is empty; allowed: the name of a file or folder")
    return Path(text)


OPTIONS = {
    "init=BOX": "--init X,Y,W,H[@FRAME]",
    "rate_hz=HZ": "--rate HZ",
    "region=X,Y,W,H": "--region X,Y,W,H",
    "stop=N": "--frames N",
    "truth=CSV": "--truth CSV",
}
"""What sentences of the library call parameters by, and which option each of them is."""

_ALONE = r"(?m)(?!^)(?<![\w.'\"/\\-]){}(?![\w'\"/\\-]|\.\w)"
"""A word by itself within a sentence: no part of a file's name, of an override or of what is quoted."""


def in_options(text: str) -> str:
    """A sentence of the library as the command line says it: `region=X,Y,W,H` is `--region X,Y,W,H`, and a module is
    imported by an option. What only begins or ends like a parameter is a word of the user's, and so is what a line
    begins with, its place."""
    for parameter, option in OPTIONS.items():
        text = re.sub(_ALONE.format(re.escape(parameter)), option, text)
    return re.sub(r"\bimport ([\w.]+) first, if you trust it", r"--import \1 before the command, if you trust it", text)


def run(app: typer.Typer, name: str) -> None:
    """Run the command `name`: what is raised on purpose becomes lines on standard error and exit status 2."""
    # Kinds and trackers of a user's own (module:Class) may lie in the folder where the command is given.
    sys.path.append(os.getcwd())
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal may know fewer letters than are printed
    came = _ending_as_by_interrupt()
    try:
        status = _called(app, name, came)
        if sys.stdout is not None:
            sys.stdout.flush()  # here, where what goes wrong with it is told
        sys.exit(status)
    except (KeyboardInterrupt, typer.Abort, StoppedError) as stopped:
        print(f"{name}: {str(stopped) or 'stopped'}", file=sys.stderr)
        sys.exit(SIGNALLED + came[0] if came else INTERRUPTED)
    except UsageError as error:
        if "\n" in error.message:  # the help, where a command was given nothing
            error.show()
        else:
            from irsim.cli.usage import usage_line

            print(f"{name}: {usage_line(error)}", file=sys.stderr)
        sys.exit(2)
    except IrsimError as error:
        for line in str(error).splitlines():
            print(f"{name}: {in_options(line)}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        # Whoever read the output has gone: leave quietly.
        _say_no_more()
        sys.exit(1)
    except MemoryError as error:
        print(
            f"{name}: out of memory: {error or 'no more is given'}; allowed: fewer or smaller frames", file=sys.stderr
        )
        sys.exit(2)
    except OSError as error:
        # Unforeseen errors. `irsim.recording.output.atomic_file` reports those of output files.
        if error.filename is None and error.errno in NO_ROOM:
            _say_no_more()
            error = OSError(f"standard output: cannot be written: {error.strerror}")
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(2)


def _say_no_more() -> None:
    """What is still to be written to standard output goes nowhere, also when Python flushes it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _called(app: typer.Typer, name: str, came: list[int]) -> Any:
    """The command's status. KeyboardInterrupt where it was interrupted, whatever that became on its way: numpy takes
    one that comes while it compares arrays for an error of its own."""
    try:
        status = app(prog_name=name, standalone_mode=False)
    except SystemExit as left:
        return left.code
    except Exception as error:
        if came and not isinstance(error, StoppedError):
            raise KeyboardInterrupt from error
        raise
    if status == INTERRUPTED:  # typer's word for KeyboardInterrupt
        raise KeyboardInterrupt
    return status


def _ending_as_by_interrupt() -> list[int]:
    """Who ends a program without a keyboard (SIGTERM: batch systems; SIGHUP: a terminal that goes) leaves as little
    behind as Ctrl-C does. The signals that came."""
    came: list[int] = []

    def end(number: int, _: object) -> None:
        came.append(number)
        if number != signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)  # a second one waits for nothing
        raise KeyboardInterrupt

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        usual = (signal.SIG_DFL, signal.default_int_handler)
        if number is not None and signal.getsignal(number) in usual:  # nohup ignores one
            signal.signal(number, end)
    return came


def _say_version(context: typer.Context, asked: bool) -> None:
    if asked:
        from irsim import __version__

        print(f"{context.find_root().info_name} {__version__}")
        raise typer.Exit


def first_options(
    modules: Annotated[
        list[str] | None,
        typer.Option(
            "--import",
            metavar="MODULE",
            help="Import this module of your own first; kinds in it may then be named by recordings and results.",
        ),
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", help="Say the version and leave.", is_eager=True, callback=_say_version)
    ] = False,
) -> None:
    """An app's callback, for options before the command. Files must not name code to run, so the user does."""
    for module in modules or ():
        try:
            importlib.import_module(module)
        except Exception as error:  # a user's module may fail in any way while it is imported
            what = " ".join(f"{type(error).__name__}: {error}".split())
            raise InputError(f"--import {module}: cannot be imported: {what}") from None


class Progress(Protocol):
    """Called with how much is done and, where that was not known before, of how much; and with what else to say."""

    def __call__(self, done: int, total: int | None = None, note: str = "") -> None: ...


def _lines(label: str, total: int | None) -> Progress:
    """Tells now and then on standard error how far it is: nothing of what is done sooner."""
    begun = told = monotonic()
    of = total

    def move(done: int, total: int | None = None, note: str = "") -> None:
        nonlocal told, of
        of, now = of if total is None else total, monotonic()
        if now - told >= TOLD_EVERY_S:
            told = now
            far = f"{done}" if of is None else f"{done} of {of}"
            print(f"{label}: {far}, {now - begun:.0f} s", *filter(None, [note]), file=sys.stderr, flush=True)

    return move


@contextmanager
def progress_bar(label: str, total: int | None = None, ticking: bool = True) -> Iterator[Progress]:
    """A bar on standard error, with rate and time left; where that is no terminal, a line every TOLD_EVERY_S.

    ticking   it is drawn by a thread, ten times a second; else only when it moves: a debugger's prompt stays as it is
    """
    if not sys.stderr.isatty():
        yield _lines(label, total)
        return
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.description}", markup=False),  # names of files may have brackets
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TextColumn("{task.fields[rate]}"),
        progress.TimeRemainingColumn(),
        progress.TextColumn("{task.fields[note]}", markup=False),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=ticking) as bar:
        task = bar.add_task(label, total=total, rate="", note="")
        drawn = monotonic()

        def move(done: int, total: int | None = None, note: str = "") -> None:
            nonlocal drawn
            speed = bar.tasks[0].speed
            bar.update(task, completed=done, total=total, rate="" if speed is None else f"{speed:.3g}/s", note=note)
            if not ticking and monotonic() - drawn > DRAWN_EVERY_S:
                bar.refresh()
                drawn = monotonic()

        yield move

"""Code shared by the commands irsim and irtrack: errors with an exit status, common options, progress bar."""

from __future__ import annotations

import errno
import importlib
import os
import re
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from time import monotonic
from typing import Annotated, Any, Protocol

import typer
from typer.core import TyperGroup

from irsim.errors import InputError, IrsimError, printable

SIGNALLED = 128
"""Exit status after a signal is this plus the signal's number, as in shells."""

INTERRUPTED = SIGNALLED + signal.SIGINT
"""Exit status after Ctrl-C."""

LONGEST_LINE = 4000
"""Largest number of characters of an error that is printed whole."""

DRAWN_EVERY_S = 0.1
"""Least time between two drawings of a progress bar, s, as in rich."""
PRINTED_EVERY_S = 10.0
"""Least time between two progress lines, where standard error is not a terminal, s."""

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers of a write to a full disk, or beyond a quota or file size limit."""


class StoppedError(Exception):
    """Ctrl-C with a message to the user. It is raised in place of KeyboardInterrupt."""


UsageError: Any = typer.BadParameter.__base__
"""Error that typer raises for wrong options and arguments. Typer has no public name for it."""


class WholeHelp(TyperGroup):
    """Group of commands whose help gives the first paragraph of each whole; typer cuts it to a line."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        found = ((name, self.get_command(ctx, name)) for name in self.list_commands(ctx))
        rows = [
            (name, " ".join((each.help or "").split("\n\n")[0].split())) for name, each in found if each is not None
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def commands(help: str) -> typer.Typer:
    """Return a typer app in plain text, with `--version` and `--import` before its sub-command."""
    return typer.Typer(
        cls=WholeHelp,
        help=help,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        add_completion=False,
        no_args_is_help=True,
        callback=first_options,
    )


def given_path(text: str | os.PathLike[str]) -> Path:
    """Return the path in an option or an argument. An empty text, as of an unset shell variable, is refused, as it
    would mean the current folder."""
    if not os.fspath(text):
        raise typer.BadParameter("is empty; allowed: the name of a file or folder")
    return Path(text)


OPTIONS = {
    "init=BOX": "--init X,Y,W,H[@FRAME]",
    "rate_hz=HZ": "--rate HZ",
    "seeds=N": "--seeds N",
    "region=X,Y,W,H": "--region X,Y,W,H",
    "stop=N": "--frames N",
    "topic=NAME": "--topic NAME",
    "trust=True": "--trust",
    "truth=LABELS": "--truth LABELS",
}
"""Parameters as the library's messages name them, and the options that set them in the commands."""

_ALONE = r"(?m)(?!^)(?<![\w.'\"/\\-]){}(?![\w'\"/\\-]|\.\w)"
"""Pattern of a separate word in a message, not within a file name, an override or quoted text."""


def in_options(text: str) -> str:
    """Return a message of the library with options in place of parameters, such as `--region X,Y,W,H` for
    `region=X,Y,W,H`, and `--import` in place of an import statement. Words of the user, such as a path at the beginning
    of a line, are not changed."""
    for parameter, option in OPTIONS.items():
        text = re.sub(_ALONE.format(re.escape(parameter)), option, text)
    return re.sub(r"\bimport ([\w.]+) first, if you trust it", r"--import \1 before the command, if you trust it", text)


def run(app: typer.Typer, name: str) -> None:
    """Run the command `name` and exit. An IrsimError becomes lines on standard error and exit status 2."""
    # The current folder may contain the user's own kinds and trackers (module:Class).
    sys.path.append(os.getcwd())
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # the terminal's encoding may lack characters
    signals = _interrupt_on_signals()
    try:
        status = _call(app, name, signals)
        if sys.stdout is not None:
            sys.stdout.flush()  # flushed here, where errors of writing are reported
        sys.exit(status)
    except (KeyboardInterrupt, typer.Abort, StoppedError) as stopped:
        print(f"{name}: {str(stopped) or 'stopped'}", file=sys.stderr)
        sys.exit(SIGNALLED + signals[0] if signals else INTERRUPTED)
    except UsageError as error:
        if "\n" in error.message:  # the help, of a command without arguments
            error.show()
        else:
            print(f"{name}: {usage_line(error)}", file=sys.stderr)
        sys.exit(2)
    except IrsimError as error:
        for line in str(error).splitlines():
            shown = line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]}... ({len(line)} characters)"
            print(f"{name}: {in_options(shown)}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        # The reader of the output has closed it.
        _discard_output()
        sys.exit(1)
    except MemoryError as error:
        print(f"{name}: out of memory: {error or 'none is left'}; allowed: fewer or smaller frames", file=sys.stderr)
        sys.exit(2)
    except OSError as error:
        # Errors of output files are reported by `irsim.recording.output.atomic_file`.
        if error.filename is None and error.errno in NO_ROOM:
            _discard_output()
            error = OSError(f"standard output: cannot be written: {error.strerror}")
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(2)
    except Exception as error:
        if not (calls := own_calls(error)):
            raise
        print("\n".join([f"{name}: {calls[-1]}", *calls[:-1]]), file=sys.stderr)
        sys.exit(1)


def own_calls(error: BaseException) -> list[str]:
    """Return the lines of the traceback from a user's first module on, and the error last; none where no module of a
    user, such as a kind of their own, was called by irsim or irtrack."""
    packages = (str(Path(__file__).parents[1]), str(Path(__file__).parents[2] / "irtrack"))
    libraries = os.path.dirname(os.__file__), str(Path(typer.__file__).parents[1])
    installed = (*packages, *libraries, *filter(None, (sys.prefix, sys.base_prefix)), "<")
    frames = traceback.extract_tb(error.__traceback__)
    within = next((at for at, frame in enumerate(frames) if frame.filename.startswith(packages)), len(frames))
    called = [at for at, frame in enumerate(frames) if at > within and not frame.filename.startswith(installed)]
    if not called:
        return []
    lines = traceback.format_list([frame for frame in frames[called[0] :] if not frame.filename.startswith(packages)])
    last = "".join(traceback.format_exception_only(error)).strip()
    return [*printable("".join(lines)).splitlines(), printable(last)]


def _discard_output() -> None:
    """Discard all further standard output, including text that Python flushes at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _call(app: typer.Typer, name: str, signals: list[int]) -> Any:
    """Return the command's exit status. Raises KeyboardInterrupt if the command was interrupted, even if a library
    turned the interrupt into another error, as numpy does while it compares arrays."""
    try:
        status = app(prog_name=name, standalone_mode=False)
    except SystemExit as left:
        return left.code
    except Exception as error:
        if signals and not isinstance(error, StoppedError):
            raise KeyboardInterrupt from error
        raise
    if status == INTERRUPTED:  # typer returns this for KeyboardInterrupt
        raise KeyboardInterrupt
    return status


def _interrupt_on_signals() -> list[int]:
    """Raise KeyboardInterrupt on SIGTERM (batch systems) and SIGHUP (closed terminal) too, so that commands leave no
    temporary files. Return the list to which received signals are appended."""
    received: list[int] = []

    def end(number: int, _: object) -> None:
        received.append(number)
        if number != signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)  # a second one ends the process at once
        raise KeyboardInterrupt

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        usual = (signal.SIG_DFL, signal.default_int_handler)
        if number is not None and signal.getsignal(number) in usual:  # nohup ignores SIGHUP
            signal.signal(number, end)
    return received


_EXPECTED = {
    "greater_than_equal": "{ge} or more",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
}
"""Text after 'must be' for each type of error of pydantic."""


def usage_line(error: Any) -> str:
    """Return one line for typer's UsageError, such as '--jobs: must be 1 or more, not 0'.

    Where the installed version of typer does not give the type of the error, the line has typer's own sentence.
    """
    from irsim.config.base import suggestion

    command = error.ctx.command if error.ctx is not None else None
    hint = f"; see {error.ctx.command_path} --help" if error.ctx is not None else ""
    option = getattr(error, "option_name", None)
    if hasattr(error, "possibilities"):
        known = [word for param in getattr(command, "params", ()) for word in param.opts]
        return f"{option}: no such option{suggestion(option, known) or hint}"
    if option is not None:
        return f"{option}: {_clause(error.message).removeprefix(f'option {option!r} ')}"
    param = getattr(error, "param", None)
    if param is None:
        return _clause(error.message) + hint
    name = max(param.opts, key=len) if param.param_type_name == "option" else param.metavar or param.name
    if not error.message:
        return f"{name}: is missing{_choices(param)}{hint}"
    for detail in getattr(error.__cause__, "errors", list)():
        if detail["type"] in _EXPECTED:
            expected = _EXPECTED[detail["type"]].format(**detail.get("ctx", {}))
            return f"{name}: must be {expected}, not {detail['input']}"
    return f"{name}: {_clause(error.message)}"


def _choices(param: Any) -> str:
    """Return '; allowed: a, b or c' for an argument whose help is a list of choices, and thus begins in lower case."""
    help = getattr(param, "help", None) or ""
    return f"; allowed: {_clause(help)}" if help[:1].islower() else ""


def _clause(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:].rstrip(".")


def _print_version(context: typer.Context, wanted: bool) -> None:
    if wanted:
        from irsim import __version__

        print(f"{context.find_root().info_name} {__version__}")
        raise typer.Exit


def first_options(
    modules: Annotated[
        list[str] | None,
        typer.Option(
            "--import",
            metavar="MODULE",
            help="Import this module first; recordings and results may then name kinds in it.",
        ),
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Handle the options before the sub-command. Only `--import` can make a command import user code; no file can."""
    for module in modules or ():
        try:
            importlib.import_module(module)
        except Exception as error:  # the module may raise anything
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise InputError(f"--import {module}: cannot be imported: {reason}") from None


class Progress(Protocol):
    """Function that takes the amount done, optionally the total if it was unknown before, and a note to print."""

    def __call__(self, done: int, total: int | None = None, note: str = "") -> None: ...


def _lines(label: str, total: int | None) -> Progress:
    """Return a Progress that prints a line every PRINTED_EVERY_S seconds, and none before."""
    begun = printed = monotonic()
    of = total

    def move(done: int, total: int | None = None, note: str = "") -> None:
        nonlocal printed, of
        of, now = of if total is None else total, monotonic()
        if now - printed >= PRINTED_EVERY_S:
            printed = now
            amount = f"{done}" if of is None else f"{done} of {of}"
            print(f"{label}: {amount}, {now - begun:.0f} s", *filter(None, [note]), file=sys.stderr, flush=True)

    return move


@contextmanager
def progress_bar(label: str, total: int | None = None, ticking: bool = True) -> Iterator[Progress]:
    """Show a progress bar on standard error with rate and remaining time; if that is not a terminal, lines.

    ticking   True: a thread draws the bar ten times a second; False: the bar is drawn only when it moves, so that it
              does not overwrite a debugger's prompt
    """
    if not sys.stderr.isatty():
        yield _lines(label, total)
        return
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.description}", markup=False),  # file names may have brackets
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

"""The rules of the entry point: each option has an environment variable, each error is a sentence with an exit code.

Exit codes: 0 success, 1 a check failed, 2 wrong use or the command could not be carried out, 130 after Ctrl-C.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

import typer
from pydantic import ValidationError
from shift_schemas.errors import ShiftError, malformed, shorten
from typer.main import get_command

WRONG = 2
INTERRUPTED = 130
"""After Ctrl-C, as shells count it: 128 and the signal's number."""
WITHOUT_VARIABLE = {"--help", "--version"}


def run(app: typer.Typer) -> NoReturn:
    """Run the command line and end the process."""
    sys.exit(outcome(app, sys.argv[1:]))


def outcome(app: typer.Typer, arguments: Sequence[str]) -> int:
    """Carry out one command line and return the exit code. An error is written to standard error."""
    try:
        command_line(app)(args=list(arguments), prog_name="shift-mesh")
    except SystemExit as e:
        if isinstance(e.__context__, typer.Abort):
            return INTERRUPTED
        return e.code if isinstance(e.code, int) else int(e.code is not None)
    except KeyboardInterrupt:
        return INTERRUPTED
    except ShiftError as e:
        return _report(e)
    except ValidationError as e:
        return _report(malformed(e.title, e))
    except OSError as e:
        where = f"{shorten(e.filename)}: " if e.filename else ""
        return _write_error(f"{where}{e.strerror or e}")
    except Exception as e:
        return _report_bug(e)
    return 0


def command_line(app: typer.Typer) -> Any:
    """Return the command of ``app``, in which an option without a variable of its own has ``SHIFT_`` and its name."""
    root = get_command(app)
    for _, command in commands(root):
        for option in command.params:
            flag = _flag(option)
            if flag and flag not in WITHOUT_VARIABLE and not option.envvar:
                option.envvar = "SHIFT_" + flag.lstrip("-").replace("-", "_").upper()
    return root


def commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield each command that does something, with its words: ``("gaze", "play")``."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield path, command
        return
    for name, child in inner.items():
        yield from commands(child, (*path, name))


def _flag(option: Any) -> str:
    return next((name for name in option.opts if name.startswith("--")), "")


def _report(error: ShiftError) -> int:
    """Write the detail, and each wrong field that it does not name."""
    further = [f"  {f.field}: {f.rule}" for f in error.errors if f.field not in error.detail]
    return _write_error("\n".join([error.detail, *further]))


def _report_bug(error: Exception) -> int:
    if os.environ.get("SHIFT_DEBUG"):
        traceback.print_exc()
    return _write_error(
        f"something went wrong inside ({type(error).__name__}: {shorten(str(error))}). This is a mistake in "
        "shift-mesh: please report it, with what SHIFT_DEBUG=1 shows"
    )


def _write_error(text: str) -> int:
    sys.stderr.write(f"shift-mesh: {text}\n")
    return WRONG

"""The command line ``isolation-sim``: one module per command.

Exit codes: 0 for success; 1 if a run diverged or its controller failed (the results of the other
runs are written); 2 for unusable input, with one line on standard error.
"""

from __future__ import annotations

import signal
import sys
import threading
import warnings
from functools import cache
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from ..errors import Diverged, InputError
from ..registry import COMMANDS
from ..version import __version__
from . import (
    check,
    cite,
    diagnose,
    evaluate,
    export,
    fit,
    import_tests,
    list_names,
    new,
    plan_tests,
    run,
    suite,
    sweep,
    tune,
)  # fmt: skip
from .common_options import TABLE_WIDTH, examples, print_error, print_warning, printed_warnings


class _Commands(TyperGroup):
    """The commands, including those of other packages, which are imported on first use."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [*super().list_commands(ctx), *COMMANDS]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        own = super().get_command(ctx, cmd_name)
        added = own is None and cmd_name in COMMANDS
        return get_command(COMMANDS[cmd_name]) if added else own


app = typer.Typer(
    name="isolation-sim",
    cls=_Commands,
    help="Semi-active base isolation with magnetorheological isolators.",
    no_args_is_help=True,
    epilog=examples(
        "isolation-sim run                     the main job: seven controllers under El Centro",
        "isolation-sim new my_scenario.toml    a commented scenario to start from",
        "isolation-sim COMMAND --help          more examples",
    ),
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"max_content_width": TABLE_WIDTH},
)


# the class of typer in some releases, of click in others
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]


def _show_version(requested: bool) -> None:
    if requested:
        print(f"isolation-sim {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Define the options without a command."""


app.command("run", epilog=run.EXAMPLES)(run.run)
app.command("compare", hidden=True)(run.run)  # a likely guess for run
app.command("list", epilog=list_names.EXAMPLES)(list_names.list_names)
app.command("import", epilog=import_tests.EXAMPLES)(import_tests.import_tests)
app.command("fit", epilog=fit.EXAMPLES)(fit.fit)
app.command("tune", epilog=tune.EXAMPLES)(tune.tune)
app.command("diagnose", epilog=diagnose.EXAMPLES)(diagnose.diagnose)
app.command("check", epilog=check.EXAMPLES)(check.check)
app.command("evaluate", epilog=evaluate.EXAMPLES)(evaluate.evaluate)
app.command("plan-tests", epilog=plan_tests.EXAMPLES)(plan_tests.plan_tests)
app.command("cite", epilog=cite.EXAMPLES)(cite.cite)
app.command("new", epilog=new.EXAMPLES)(new.new)
app.command("suite", epilog=suite.EXAMPLES)(suite.suite)
app.add_typer(sweep.app, name="sweep")
app.add_typer(export.app, name="export")


@cache
def _command() -> Any:
    """Build the commands once: it takes longer than most of them need."""
    return get_command(app)


def _stop(number: int, frame: object) -> None:
    """Turn a signal into an exception, so that hidden work folders are removed."""
    raise SystemExit(128 + number)


def _stop_again(ignored: Any) -> None:
    """Send the signal again if Python ignored its exception, as in a compiler's callback."""
    if isinstance(ignored.exc_value, SystemExit):
        threading.Timer(0.05, signal.raise_signal, [signal.SIGTERM]).start()
    else:
        sys.__unraisablehook__(ignored)


def _print_warning(message: Any, *_: Any, **__: Any) -> None:
    """Print a Python warning as one line, without its place in this package."""
    print_warning(str(message))


def _end_at_usage(error: Any) -> None:
    """Name the unusable option or argument in one line; show the help if there are none."""
    context = error.ctx
    if context is not None and type(error).__name__ == "NoArgsIsHelpError":
        print(context.get_help())
    else:
        path = context.command_path if context is not None else "isolation-sim"
        message = " ".join(error.format_message().split())
        print_error(f"{message.rstrip('.')}; expected: a command line as {path} --help shows it")
    sys.exit(2)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _stop)
        sys.unraisablehook = _stop_again
    warnings.showwarning = _print_warning
    printed_warnings.clear()
    try:
        code = _command().main(arguments, "isolation-sim", standalone_mode=False)
        sys.exit(code if isinstance(code, int) else 0)
    except _UsageError as error:
        _end_at_usage(error)
    except typer.Abort:
        print_error("stopped")
        sys.exit(130)
    except (InputError, Diverged) as error:
        print_error(error)
        sys.exit(1 if isinstance(error, Diverged) else 2)
    except OSError as error:
        print_error(f"{error.filename or 'results'}: {error.strerror or error}")
        sys.exit(2)

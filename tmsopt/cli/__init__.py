"""The tmsopt command: one small module for each command, over the public functions of the library.

In: words of a command line. Out: text or JSON on stdout, progress and diagnostics on stderr, an exit status. This
module imports almost nothing, so that signals are handled before the other modules load. Read `command` first: it turns
a dataclass into a command. Then read `answers`, which prints and writes results. Signals are in `ending`.
"""

import os
import signal
import sys

from tmsopt.threads import ONE_THREAD

TYPE_CHECKING = False  # importing typing would double the loading time of this module
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import NoReturn

    from tmsopt.cli.commands import command_group as command_group


def main(args: "Sequence[str] | None" = None, prog_name: str | None = None) -> "NoReturn":
    """Run a command and exit with its status, or with 128 and the number of the signal that stopped it.

    If `args` is None, linear algebra uses one thread, unless the environment sets another number.

    Args:
        args: words of the command line; by default those of this process, which ends after the command.
    """
    if args is None:  # figures are written to files, so no window is needed; a notebook keeps its setting
        os.environ.pop("MPLBACKEND", None)
        if not ONE_THREAD.keys() & os.environ:
            os.environ.update(ONE_THREAD)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends the process, until the other modules are loaded
    from tmsopt.cli.ending import exit_now, handle_signals, open_streams, report_end
    from tmsopt.cli.terminal import show_progress

    status: int | str | None = 0
    with handle_signals(ends_process=args is None) as signals:
        try:
            with open_streams() as terminal, report_end(), show_progress(terminal):
                from tmsopt.cli.commands import command_group

                command_group.main(args, prog_name)
        except SystemExit as end:
            status = end.code
        if signals.status:
            status = signals.status
            if args is None:
                exit_now(signals.status)
    sys.exit(status)


def __getattr__(name: str) -> object:
    """Load `command_group`, the click group of all commands."""
    if name != "command_group":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from tmsopt.cli.commands import command_group

    return command_group

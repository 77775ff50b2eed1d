"""The tmsopt command: one small module for each command, over the public functions of the library.

In: words of a command line. Out: text or JSON on stdout, progress and diagnostics on stderr, an exit status. This face
imports next to nothing, so that signals are handled before the rest loads. Open `command` first: how a dataclass
becomes a command. Then `answers` and `outputs`: what commands print and write. Signals are in `ending`.
"""

import os
import signal
import sys

from tmsopt.threads import ONE_THREAD

TYPE_CHECKING = False  # typing takes as long to load as all else here
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import NoReturn

    from tmsopt.cli.commands import every as every


def main(args: "Sequence[str] | None" = None, prog_name: str | None = None) -> "NoReturn":
    """Run a command and exit with its status, or with 128 and the number of the signal that stopped it.

    A process of its own has one thread for linear algebra, unless the environment says otherwise.

    Args:
        args: words of the command line; by default those of this program, which then ends.
    """
    if args is None:  # figures go into files, whatever windows the user has; a notebook keeps its own
        os.environ.pop("MPLBACKEND", None)
        if not ONE_THREAD.keys() & os.environ:
            os.environ.update(ONE_THREAD)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # until the rest is loaded, as for SIGTERM
    from tmsopt.cli.ending import exit_now, handle_signals, open_streams, report_end
    from tmsopt.cli.terminal import show_progress

    status: int | str | None = 0
    with handle_signals(for_good=args is None) as heard:
        try:
            with open_streams() as terminal, report_end(), show_progress(terminal):
                from tmsopt.cli.commands import every

                every.main(args, prog_name)
        except SystemExit as end:
            status = end.code
        if heard.status:
            status = heard.status
            if args is None:
                exit_now(heard.status)
    sys.exit(status)


def __getattr__(name: str) -> object:
    """`every`, the commands as click knows them."""
    if name != "every":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from tmsopt.cli.commands import every

    return every

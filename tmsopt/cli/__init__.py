"""The tmsopt command: one thin room per command, over the public functions of the library.

In: words of a command line. Out: text or JSON on stdout, progress and diagnostics on stderr, an exit status. Heavy
imports stand inside commands, and this face imports next to nothing: signals are heard before the rest is loaded. Open
`common` first: what commands share; `ending` has what ends them from outside.
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

    A process of its own has one thread for linear algebra, where the environment does not say otherwise.

    Args:
        args: words of the command line; by default those of this program, which then ends.
    """
    if args is None:  # figures are drawn into files, whatever windows the user's own have; a notebook keeps its own
        os.environ.pop("MPLBACKEND", None)
        if not ONE_THREAD.keys() & os.environ:
            os.environ.update(ONE_THREAD)
    if args is None and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # until the rest is loaded, as it is for SIGTERM
    from tmsopt.cli.ending import ended, gone, listening, streams
    from tmsopt.cli.terminal import showing

    status: int | str | None = 0
    with listening(for_good=args is None) as heard:
        try:
            with streams() as terminal, ended(), showing(terminal):
                from tmsopt.cli.commands import every

                every.main(args, prog_name)
        except SystemExit as end:
            status = end.code
        if heard.number is not None:
            status = heard.status
            if args is None:
                gone(heard.status)
    sys.exit(status)


def __getattr__(name: str) -> object:
    """The commands as click knows them, ``every``, for programs that call them themselves."""
    if name != "every":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from tmsopt.cli.commands import every

    return every

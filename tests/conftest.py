"""What makes the whole suite cheaper and the same wherever it is run, and changes no test."""

import gc
import os
import signal

import pytest

# Before NumPy is loaded. Each of the two or more workers has a core: more threads of the linear algebra only take it away
# from another one, and spin while they wait.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")


LONGEST = (
    "test_engines",
    "test_certify",
    "test_trace",
    "test_store",
    "test_problems",
    "test_study",
    "test_domain",
    "test_pareto",
    "test_solve",
    "test_relax",
    "test_family",
    "test_cli",
    "test_digits",
    "test_cases",
    "test_nearest",
    "test_sides",
)
"""Files that come first: one begun at the end would keep a single worker busy while the others wait."""


def pytest_collection_modifyitems(items):
    """The order between files only; within a file it stays."""
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.stem, len(LONGEST)))


def pytest_collection_finish():
    """Collected tests and loaded modules stay until the end: no collection of garbage need look at them again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module")
def browser():
    """Chromium, or the test is skipped."""
    from helpers.browser import chromium

    with chromium() as started:
        yield started


@pytest.fixture
def run(capsys):
    """A command in this process, to save starting so many: exit status, stdout, stderr."""
    from tmsopt.cli import main

    def run(*words):
        with pytest.raises(SystemExit) as stop:
            main(args=[*map(str, words)], prog_name="tmsopt")
        written = capsys.readouterr()
        return stop.value.code, written.out, written.err

    return run


@pytest.fixture
def interruptible():
    """What ends a process ends one that is started now. A suite in the background of a script, or one that nobody is to
    hang up, ignores some of it, and so would that."""
    first = {"SIGINT": signal.default_int_handler, "SIGTERM": signal.SIG_DFL, "SIGHUP": signal.SIG_DFL}
    numbers = {getattr(signal, name): handler for name, handler in first.items() if hasattr(signal, name)}
    before = {number: signal.signal(number, handler) for number, handler in numbers.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)

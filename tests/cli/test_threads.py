"""How many threads linear algebra has: one in the process of a command, a user's own number everywhere else."""

import json
import os
import subprocess
import sys

import pytest

from tmsopt.threads import ONE_THREAD

COMMAND = """
import sys
from tmsopt.cli import main
sys.argv = ["tmsopt", "describe", "tms"]
try:
    main()
except SystemExit:
    pass
"""
LIBRARY = "import tmsopt; tmsopt.models.tms"
CALLED = 'from tmsopt.cli import command_group; command_group.main(["describe", "tms"], standalone_mode=False)'
COUNT = """
import json, os, numpy
from threadpoolctl import threadpool_info
threads = [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]
print()
print(json.dumps([threads, sorted(name for name in os.environ if name.endswith("_THREADS"))]))
"""


def counted(program, **own):
    """Threads of each library of linear algebra after a program, and the variables that are set then."""
    environment = {n: x for n, x in os.environ.items() if n not in ONE_THREAD} | own
    ended = subprocess.run(
        [sys.executable, "-c", program + COUNT], capture_output=True, text=True, check=True, env=environment
    )
    threads, variables = json.loads(ended.stdout.splitlines()[-1])
    return set(threads), variables


def test_a_command_has_one():
    threads, _ = counted(COMMAND)
    assert threads == {1}


def test_what_the_user_has_set_stays():
    threads, variables = counted(COMMAND, OPENBLAS_NUM_THREADS="2")
    assert variables == ["OPENBLAS_NUM_THREADS"]
    assert threads == counted("", OPENBLAS_NUM_THREADS="2")[0]


@pytest.mark.parametrize("program", [LIBRARY, CALLED])
def test_a_program_keeps_its_own(program):
    assert counted(program) == counted("")

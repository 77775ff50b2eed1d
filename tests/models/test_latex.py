"""Formulas as LaTeX: read back, they have the value of the formula, and Matplotlib sets them."""

import math
import re

import numpy as np
import pytest
from matplotlib.mathtext import MathTextParser

import tmsopt
from tmsopt.models import from_coefficients, from_matrices, tms, whipple

LATEX = {
    "tms": tms,
    "absorber": from_matrices(
        M=[[1, 0], [0, "mu"]], D=[["c", "-c"], ["-c", "c"]], K=[["1 + mu*w**2", "-mu*w**2"], ["-mu*w**2", "mu*w**2"]]
    ),
    "every function": from_coefficients(
        ["1", "-c", "sqrt(2)*k - 3", "abs(c) - 1/3", "-(c - k)**2*exp(-k) - (-k) - (c + k - 3)", "1e-9*pi + k**(-c/2)"]
    ),
    "of angles": from_coefficients(["2", "sin(c)*cos(k)", "tan(c)/(1 - k)", "(c/k)**2", "min(c, k) - max(c, 0.3)"]),
}


def matched(text, start):
    """The end of what the brace at `start` opens."""
    depth = 0
    for k in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[k], 0)
        if depth == 0:
            return k
    raise ValueError(text)


def braced(text, command, count, written):
    """A text with each command of so many arguments in braces written otherwise, inner ones first."""
    while (start := text.rfind(command + "{")) >= 0:
        end, parts = start + len(command) - 1, []
        for _ in range(count):
            first = end + 1
            end = matched(text, first)
            parts.append(text[first + 1 : end])
        text = text[:start] + written.format(*parts) + text[end + 1 :]
    return text


def python_of(text, of):
    """An expression of Python for what `_repr_latex_` writes, by rules of text alone."""
    for p in sorted(of.parameters, key=lambda p: -len(p.latex)):
        text = re.sub(r"(?<![A-Za-z])" + re.escape(p.latex) + r"(?![A-Za-z])", f" {p.name} ", text)
    text = text.replace(r"\left|", "abs(").replace(r"\right|", ")").replace(r"\left", "").replace(r"\right", "")
    for command, count, written in ((r"\frac", 2, "(({})/({}))"), (r"\sqrt", 1, "sqrt({})"), ("^", 1, "**({})")):
        text = braced(text, command, count, written)
    return text.replace(r"\,", "*").replace(r"\cdot", "*").replace("\\", " ").replace("=", "-")


@pytest.mark.parametrize("name", LATEX)
def test_a_polynomial_read_back_has_its_values(name):
    model, rng = LATEX[name], np.random.default_rng(0)
    of, functions = model.sets[0], {n: getattr(math, n) for n in ("sqrt", "exp", "sin", "cos", "tan", "pi")}
    python = python_of(model._repr_latex_().strip("$"), of)
    for _ in range(100):
        given = {n: float(rng.uniform(0.2, 0.9)) for n in of.names}
        s = float(rng.uniform(-2, 2))
        exact = sum(float(c) * s**k for k, c in enumerate(reversed(model.coefficients(given, of))))
        found = eval(python, {"__builtins__": {"abs": abs, "min": min, "max": max}}, {**functions, **given, "s": s})
        assert found == pytest.approx(exact, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", LATEX)
def test_matplotlib_sets_it(name):
    assert MathTextParser("path").parse(LATEX[name]._repr_latex_().strip("$").join("$$"))


def test_a_page_is_the_most():
    assert whipple._repr_latex_() is None
    assert tmsopt.models.from_hamiltonian([["w", "k"], ["k", "-w"]])._repr_latex_() is None

"""The architecture of the design (section 3), read from the imports."""

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = "tmsopt"
STAGES = ("roots", "models", "design", "study", "show", "cli")
"""Data flows one way; each stage may import the earlier ones."""


def sources() -> dict[str, str]:
    """Module name → source of the whole package."""
    found = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text(encoding="utf-8")
    return found


SOURCES = sources()


def imports(module: str, modules: Mapping[str, str]) -> Iterator[str]:
    """Modules that a module imports, at its top or anywhere inside; relative imports and import_module resolved."""
    is_package = any(other.startswith(f"{module}.") for other in modules)
    for node in ast.walk(ast.parse(modules[module])):
        match node:
            case ast.Import(names=names):
                yield from (alias.name for alias in names)
            case ast.ImportFrom(module=origin, names=names, level=level):
                base = origin or ""
                if level:
                    parents = module.split(".") + ([""] if is_package else [])
                    base = ".".join([*parents[:-level], *([origin] if origin else [])])
                for alias in names:
                    inner = f"{base}.{alias.name}"
                    yield inner if inner in modules else base
            case ast.Call(func=ast.Name(id="import_module" | "__import__"), args=[ast.Constant(value=str(name)), *_]):
                yield name
            case ast.Call(func=ast.Attribute(attr="import_module"), args=[ast.Constant(value=str(name)), *_]):
                yield name


def stage(module: str) -> str:
    """The folder or file directly below the package; "" for the package itself."""
    return module.split(".")[1] if "." in module else ""


def breaches(modules: Mapping[str, str]) -> list[str]:
    """Imports that the table forbids."""
    found = []
    for module in modules:
        own = stage(module)
        for target in imports(module, modules):
            if target.split(".")[0] != PACKAGE or own in ("", "__main__"):
                continue  # the package itself and its command are above every stage
            other = stage(target)
            if other == "laws":
                allowed = own in ("study", "show", "cli")
            elif own == "laws":
                allowed = False
            elif other == "":
                allowed = own == "cli"  # the public list stands above what it lists
            else:
                allowed = STAGES.index(other) <= STAGES.index(own)
            if not allowed:
                found.append(f"{module} imports {target}")
    return found


def cycles(modules: Mapping[str, str]) -> list[str]:
    graph = {m: {t for t in imports(m, modules) if t in modules and t != m} for m in modules if m != PACKAGE}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def names_called(source: str) -> Iterator[str]:
    """Names and attributes that are called, and every name that is used at all: f, a.f."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name):
                yield name


def calls(source: str, *functions: str) -> list[int]:
    """Lines that call a builtin by its bare name, or builtins.name."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call)
        and (
            (isinstance(node.func, ast.Name) and node.func.id in functions)
            or (
                isinstance(node.func, ast.Attribute)
                and node.func.attr in functions
                and isinstance(node.func.value, ast.Name)
                and node.func.value.id == "builtins"
            )
        )
    ]


def writes(source: str) -> list[int]:
    """Lines that write to the terminal: print, sys.stdout and sys.stderr, input."""
    streams = [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute)
        and node.attr in ("stdout", "stderr")
        and isinstance(node.value, ast.Name)
        and node.value.id == "sys"
    ]
    return calls(source, "print", "input") + streams


def callers_of_ipopt(modules: Mapping[str, str]) -> list[str]:
    """Modules that build a solver: CasADi's nlpsol, by name or as text, or its Opti stack."""
    return [m for m, source in modules.items() if {"nlpsol", "Opti", "OptiAdvanced"} & set(names_called(source))]


def test_the_package_is_there() -> None:
    """So that nothing below passes because nothing was read."""
    assert len(SOURCES) > 15
    assert {stage(m) for m in SOURCES} >= {"roots", "models", "design", "laws"}
    assert {stage(m) for m in SOURCES} - {"", "laws", "__main__"} <= set(STAGES)
    assert "tmsopt.roots.numeric" in set(imports("tmsopt.roots", SOURCES))


def test_each_stage_imports_only_earlier_ones() -> None:
    assert breaches(SOURCES) == []


def test_laws_stand_alone() -> None:
    """An oracle must not share code with what it checks."""
    assert [t for t in imports("tmsopt.laws", SOURCES) if t.split(".")[0] == PACKAGE] == []


def test_there_are_no_import_cycles() -> None:
    assert cycles(SOURCES) == []


def test_nothing_prints_below_the_command_line() -> None:
    assert {m: writes(s) for m, s in SOURCES.items() if stage(m) != "cli" and writes(s)} == {}


def test_ipopt_has_one_caller() -> None:
    assert callers_of_ipopt(SOURCES) == ["tmsopt.formulation.ipopt"]


def test_no_text_is_run_as_python() -> None:
    assert {m: found for m, s in SOURCES.items() if (found := calls(s, "eval", "exec", "compile", "__import__"))} == {}


def test_pint_is_named_in_one_module_and_inside_a_function() -> None:
    """Imported only when a unit is written; that it is not before is tested in a fresh process in test_units."""
    assert [m for m in SOURCES if "pint" in set(imports(m, SOURCES))] == ["tmsopt.design.units"]
    top = ast.parse(SOURCES["tmsopt.design.units"]).body
    assert not any("pint" in ast.unparse(n) for n in top if isinstance(n, ast.Import | ast.ImportFrom))


def test_no_formula_is_written_twice() -> None:
    """One formula has one home: a function named after an equation of the paper appears in laws and one other place."""
    homes = [m for m, s in SOURCES.items() if "def copo(" in s]
    assert homes == ["tmsopt.laws", "tmsopt.models.tms_equations"]


@pytest.mark.parametrize("heavy", ["casadi", "numpy", "scipy", "matplotlib", "pint", "pydantic", "flint"])
def test_import_tmsopt_is_light(heavy: str, modules_after_import: set[str]) -> None:
    """`tmsopt --help` answers in 0.15 s; CasADi alone takes longer to load."""
    assert PACKAGE in modules_after_import
    assert heavy not in modules_after_import


@pytest.fixture(scope="module")
def modules_after_import() -> set[str]:
    script = "import sys, tmsopt; print(*sys.modules)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    return set(ended.stdout.split())


@pytest.mark.parametrize(
    "name", ["laws", "models", "roots", "Problem", "load", "solve", "Solution", "NotSolved", "InputError"]
)
def test_the_public_list_is_reachable(name: str) -> None:
    script = f"import tmsopt; assert {name!r} in dir(tmsopt) and {name!r} in tmsopt.__all__; tmsopt.{name}"
    subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=True)


# The checks themselves, on packages that break each rule


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("tmsopt.roots.a", "from tmsopt.models import tms"),
        ("tmsopt.roots.a", "def f():\n    import tmsopt.solver.solve"),
        ("tmsopt.models.a", "from tmsopt import design"),
        ("tmsopt.models.a", "from ..design import solve"),
        ("tmsopt.design.a", "from tmsopt import laws"),
        ("tmsopt.design.a", "from tmsopt.laws import copo"),
        ("tmsopt.design.a", "import tmsopt.laws"),
        ("tmsopt.design.a", "from importlib import import_module\nimport_module('tmsopt.study.b')"),
        ("tmsopt.design.a", "from tmsopt import solve"),
        ("tmsopt.study.a", "from tmsopt.report import b"),
        ("tmsopt.show.a", "import tmsopt.cli"),
        ("tmsopt.laws", "from tmsopt.roots import product"),
    ],
)
def test_a_breach_is_seen(module: str, source: str) -> None:
    others = [
        "tmsopt",
        "tmsopt.laws",
        "tmsopt.cli",
        *(f"tmsopt.{s}" for s in STAGES[:-1]),
        "tmsopt.solver.solve",
        "tmsopt.show.b",
    ]
    assert breaches({**dict.fromkeys(others, ""), module: source}) != []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("tmsopt.models.a", "from tmsopt.roots import product"),
        ("tmsopt.study.a", "from tmsopt import laws"),
        ("tmsopt.cli", "import tmsopt"),
        ("tmsopt.laws", "import numpy"),
        ("tmsopt.design.b", "from .a import x"),
    ],
)
def test_what_the_table_allows_is_no_breach(module: str, source: str) -> None:
    others = ["tmsopt", "tmsopt.laws", *(f"tmsopt.{s}" for s in STAGES[:-1]), "tmsopt.design.a"]
    assert breaches({**dict.fromkeys(others, ""), module: source}) == []


def test_the_other_checks_see_what_they_look_for() -> None:
    assert cycles({"tmsopt": "", "tmsopt.a": "import tmsopt.b", "tmsopt.b": "def f():\n    from tmsopt import a"})
    assert not cycles({"tmsopt": "", "tmsopt.a": "import tmsopt.b", "tmsopt.b": ""})
    assert writes("def f():\n    print(1)") == [2]
    assert writes("import sys\nsys.stderr.write('x')") == [2]
    assert writes("'print(1)'  # print(1)") == []
    assert calls("eval('1')\nexec('1')\nmodel.eval()\nbuiltins.eval('1')", "eval", "exec") == [1, 2, 4]
    assert callers_of_ipopt({"a": "import casadi as ca\nca.nlpsol('s', 'ipopt', {})", "b": "x = 1"}) == ["a"]
    assert callers_of_ipopt({"a": "from casadi import nlpsol as n", "b": "import casadi\ncasadi.Opti()"}) == ["b"]

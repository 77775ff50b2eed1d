"""The architecture of the design (section 3), read from the imports."""

import ast
import graphlib
import re
import subprocess
import sys
from functools import cache
from importlib import import_module

import pytest
from helpers.places import ROOT

PACKAGE = "tmsopt"
FLOORS = (
    ("errors", "records", "progress", "files", "deprecated", "executor", "killable", "threads", "versions", "laws"),
    ("algebra",),
    ("roots",),
    ("models",),
    ("problem",),
    ("chains",),
    ("program",),
    ("tracing", "boundaries"),
    ("evaluation", "charts"),
    ("global_search",),
    ("search",),
    ("proofs", "analysis", "fronts", "studies", "spectra"),
    ("dynamics",),
    ("paper",),
    ("plots", "guide"),
    ("explorer",),
    ("documents",),
    ("cli",),
)
"""From the ground up. A package may import what lies below it, and its own rooms; nobody on its own floor."""

ASKED_ABOVE = {("tmsopt.records", "tmsopt.documents")}
"""A result asks who shows it when it is shown, and knows nothing of them: the one import that may run up."""

FLOOR = {name: number for number, names in enumerate(FLOORS) for name in names}
GROUND = FLOORS[0]


def sources():
    """Module name → source of the whole package."""
    found = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text(encoding="utf-8")
    return found


SOURCES = sources()


@cache
def nodes(source):
    """Every node of a source, parsed once for all tests."""
    return tuple(ast.walk(ast.parse(source)))


def imports(module, modules):
    """Modules that a module imports, at its top or anywhere inside; relative imports and import_module resolved."""
    is_package = any(other.startswith(f"{module}.") for other in modules)
    for node in nodes(modules[module]):
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


def stage(module):
    """The folder or file directly below the package; "" for the package itself."""
    return module.split(".")[1] if "." in module else ""


def breaches(modules):
    """Imports that run up, or along a floor."""
    found = []
    for module in modules:
        own = stage(module)
        if own in ("", "__main__"):
            continue  # the package itself and its command are above every floor
        for target in imports(module, modules):
            other = stage(target)
            if (module, target) in ASKED_ABOVE:
                continue
            if target.split(".")[0] != PACKAGE or (other == own and own != "laws"):
                continue
            if other == "":
                allowed = own == "cli"  # the public list stands above what it lists
            elif {own, other} <= set(GROUND):
                allowed = "laws" not in (own, other)
            elif other == "laws":  # what is checked shares nothing with the oracle; what checks may ask it
                allowed = FLOOR[own] >= FLOOR["evaluation"]
            else:
                allowed = FLOOR[other] < FLOOR[own]
            if not allowed:
                found.append(f"{module} imports {target}")
    return found


def cycles(modules):
    pairs = {m: {(m, t) for t in imports(m, modules) if t in modules and t != m} for m in modules if m != PACKAGE}
    graph = {m: {t for _, t in found - ASKED_ABOVE} for m, found in pairs.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def names_called(source):
    """Names and attributes that are called, and every name that is used at all: f, a.f."""
    for node in nodes(source):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name):
                yield name


def calls(source, *functions):
    """Lines that call a builtin by its bare name, or builtins.name."""
    return [
        node.lineno
        for node in nodes(source)
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


def writes(source):
    """Lines that write to the terminal: print, sys.stdout and sys.stderr, input."""
    streams = [
        node.lineno
        for node in nodes(source)
        if isinstance(node, ast.Attribute)
        and node.attr in ("stdout", "stderr")
        and isinstance(node.value, ast.Name)
        and node.value.id == "sys"
    ]
    return calls(source, "print", "input") + streams


WRITERS = (
    "write_text",
    "write_bytes",
    "savefig",
    "to_netcdf",
    "to_csv",
    "to_parquet",
    "write_table",
    "savez",
    "savez_compressed",
    "savetxt",
    "tofile",
)


def written(module, source):
    """Functions that write a file but not to the place that `files.write_atomic` or `write_text` gives."""
    for function in nodes(source):
        if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        safe = {
            inner
            for node in ast.walk(function)
            if isinstance(node, ast.With) and any("write_atomic(" in ast.unparse(item) for item in node.items)
            for inner in ast.walk(node)
        }
        if any(isinstance(node, ast.Call) and node not in safe and _writes_file(node) for node in ast.walk(function)):
            yield f"{module}.{function.name}"


def _writes_file(call):
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name in ("open", "fdopen"):
        given = [*call.args, *(k.value for k in call.keywords if k.arg == "mode")]
        modes = [a.value for a in given if isinstance(a, ast.Constant) and isinstance(a.value, str)]
        return any(len(mode) < 4 and set(mode) & set("wax+") for mode in modes)
    return (name in WRITERS and isinstance(call.func, ast.Attribute)) or ast.unparse(call.func) == "np.save"


def callers_of_solvers(modules):
    """Modules that build a solver: CasADi's nlpsol, by name or as text, or its Opti stack."""
    return [m for m, source in modules.items() if {"nlpsol", "Opti", "OptiAdvanced"} & set(names_called(source))]


PACKAGES = sorted({m for m in SOURCES if any(other.startswith(f"{m}.") for other in SOURCES)} - {PACKAGE})


def test_the_package_is_there():
    """So that nothing below passes because nothing was read."""
    assert len(SOURCES) > 150
    assert {stage(m) for m in SOURCES} - {"", "__main__"} == set(FLOOR)
    assert "tmsopt.roots.numeric" in set(imports("tmsopt.roots", SOURCES))


def test_no_import_runs_up():
    assert breaches(SOURCES) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_has_a_face(package):
    """Its docstring says in two to five lines what it is for, what goes in and comes out, and what to open first."""
    face = ast.get_docstring(ast.parse(SOURCES[package])) or ""
    assert 2 <= len([line for line in face.splitlines() if line]) <= 5, face


def test_what_is_asked_above_is_asked_when_it_is_needed():
    """By name and inside a function, so that a result carries nobody who shows it."""
    script = "import sys, tmsopt.problem.solution, tmsopt.tracing.branch; print(*sys.modules)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    assert not {"tmsopt.documents", "tmsopt.plots", "matplotlib"} & set(ended.stdout.split())


def test_a_class_name_has_one_meaning():
    homes = {}
    for module, source in SOURCES.items():
        for node in nodes(source):
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(module)
    assert {name: found for name, found in homes.items() if len(found) > 1} == {}


def test_no_package_has_the_name_of_a_public_function():
    """A package tmsopt/solve would take the place of tmsopt.solve; some are public as packages."""
    assert set(FLOOR) & set(import_module(PACKAGE).__all__) == {"laws", "models", "plots", "roots"}


def test_tests_open_packages_by_their_faces():
    """Rooms may be rebuilt and tests stay; what replaces a part of a room names it in import_module."""
    inner = {m for m in SOURCES if m.count(".") > 1} - set(PACKAGES)
    texts = {path: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")}
    opened = [
        (path, m) for path, text in texts.items() for m in re.findall(r"^ *from (\S+) import", text, re.MULTILINE)
    ]
    assert [pair for pair in opened if pair[1] in inner] == []


def test_laws_stand_alone():
    """An oracle must not share code with what it checks."""
    assert [t for t in imports("tmsopt.laws", SOURCES) if t.split(".")[0] == PACKAGE] == []


def test_there_are_no_import_cycles():
    assert cycles(SOURCES) == []


def test_commands_call_the_public_functions():
    """A command and its function are one path: commands open tmsopt, faces of packages and each other, no rooms."""
    rooms = {m for m in SOURCES if m.count(".") > 1 and stage(m) != "cli"} - set(PACKAGES)
    taken = {(m, t) for m in SOURCES if stage(m) == "cli" for t in imports(m, SOURCES) if t in rooms}
    assert {pair for pair in taken if not exported(*pair[1].rsplit(".", 1))} == set()


def exported(package, name):
    """Whether a face hands a name on, which a room of the package may have too; a lazy one by its stub."""
    stub = ROOT / package.replace(".", "/") / "__init__.pyi"
    source = stub.read_text(encoding="utf-8") if stub.exists() else SOURCES[package]
    listed = (n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.ImportFrom))
    return any(alias.name == name for node in listed for alias in node.names)


def test_public_names_are_declared_once():
    """In the stub, which type checkers read and the lazy loader too."""
    stub = ast.parse((ROOT / PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    declared = [alias.name for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert len(declared) == len(set(declared))
    assert sorted(declared) == sorted(import_module(PACKAGE).__all__)
    assert all(hasattr(import_module(PACKAGE), name) for name in declared)


def test_nothing_prints_below_the_command_line():
    assert {m: writes(s) for m, s in SOURCES.items() if stage(m) != "cli" and writes(s)} == {}


def test_solvers_of_programs_have_one_caller_each():
    """IPOPT, and the SQP method that rechecks a radius without it."""
    assert callers_of_solvers(SOURCES) == ["tmsopt.program.ipopt", "tmsopt.program.sqp"]


def test_no_text_is_run_as_python():
    assert {m: found for m, s in SOURCES.items() if (found := calls(s, "eval", "exec", "compile", "__import__"))} == {}


def test_files_are_written_whole():
    """A full disk or Ctrl-C leaves the earlier file; each exception says why it may."""
    found = {place for m, s in SOURCES.items() for place in written(m, s)}
    assert found == {
        "tmsopt.cli.ending.open_streams",  # stdout
        "tmsopt.charts.folder.write",
        "tmsopt.charts.folder.sync",
        "tmsopt.charts.folder._create",  # recorded last
        "tmsopt.files.write_atomic",  # itself
        "tmsopt.documents.html._save_image",
        "tmsopt.plots.style.render",  # in memory
        "tmsopt.killable.serve_calls",  # a pipe
        "tmsopt.studies.export._write_csv",
        "tmsopt.studies.export._write_netcdf",
        "tmsopt.studies.export._write_parquet",  # by `export`
    }


def test_pint_is_named_in_one_module_and_inside_a_function():
    """Imported only when an unusual unit is written; that it is not before is tested in a fresh process in test_units."""
    assert [m for m in SOURCES if "pint" in set(imports(m, SOURCES))] == ["tmsopt.problem.units.text"]
    top = ast.parse(SOURCES["tmsopt.problem.units.text"]).body
    assert not any("pint" in ast.unparse(n) for n in top if isinstance(n, ast.Import | ast.ImportFrom))


def test_no_formula_is_written_twice():
    """One formula has one home: a function named after an equation of the paper appears in laws and one other place."""
    homes = [m for m, s in SOURCES.items() if "def copo(" in s]
    assert homes == ["tmsopt.laws", "tmsopt.models.bicycles.tms_equations"]


@pytest.mark.parametrize("heavy", ["casadi", "numpy", "scipy", "matplotlib", "pint", "pydantic", "flint"])
def test_import_and_help_are_light(heavy, modules_loaded):
    """`tmsopt --help` answers in 0.15 s; CasADi alone takes longer to load."""
    assert PACKAGE in modules_loaded
    assert heavy not in modules_loaded


@pytest.fixture(
    scope="module",
    params=[
        "import tmsopt",
        "from tmsopt.cli.commands import command_group; command_group(['--help'], standalone_mode=False)",
    ],
)
def modules_loaded(request):
    script = f"{request.param}; import sys; print(*sys.modules, file=sys.stderr)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    return set(ended.stderr.split())


@pytest.mark.parametrize("command", ["solve", "prove", "compare", "speeds"])
@pytest.mark.slow
def test_everyday_commands_load_what_they_need_alone(command):
    """Half a second: pint reads unusual units, SciPy decides what few problems ask, branch and bound what is not known."""
    words = [command, "problems/ep4.toml"]
    script = f"from tmsopt.cli.commands import command_group; command_group({words!r}, standalone_mode=False)"
    loaded = f"import sys\ntry:\n    {script}\nfinally:\n    print(*sys.modules, file=sys.stderr)"
    ended = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, cwd=ROOT, check=False)
    modules = set(ended.stderr.split())
    assert {"casadi", "tmsopt.search.solve"} <= modules
    assert not {"pint", "scipy", "matplotlib", "pandas", "tmsopt.global_search.stability"} & modules


@pytest.mark.parametrize(
    "name", ["laws", "models", "roots", "Problem", "load", "solve", "Solution", "NotSolved", "InputError"]
)
def test_the_public_list_is_reachable(name):
    script = f"import tmsopt; assert {name!r} in dir(tmsopt) and {name!r} in tmsopt.__all__; tmsopt.{name}"
    subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=True)


# The checks themselves, on packages that break each rule


SMALL = dict.fromkeys(["tmsopt", *(f"tmsopt.{name}" for name in FLOOR), "tmsopt.search.solve", "tmsopt.plots.b"], "")


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("tmsopt.roots.a", "from tmsopt.models import tms"),
        ("tmsopt.roots.a", "def f():\n    import tmsopt.search.solve"),
        ("tmsopt.models.a", "from tmsopt import problem"),
        ("tmsopt.models.a", "from ..search import solve"),
        ("tmsopt.problem.a", "from tmsopt import laws"),
        ("tmsopt.search.a", "from tmsopt.proofs import prove"),
        ("tmsopt.proofs.a", "from tmsopt.analysis import explain"),
        ("tmsopt.problem.a", "from importlib import import_module\nimport_module('tmsopt.charts')"),
        ("tmsopt.problem.a", "from tmsopt import solve"),
        ("tmsopt.studies.a", "from tmsopt.plots import b"),
        ("tmsopt.plots.a", "import tmsopt.cli"),
        ("tmsopt.laws", "from tmsopt.roots import product"),
        ("tmsopt.laws", "from tmsopt.records import Table"),
        ("tmsopt.files", "from tmsopt.roots import product"),
    ],
)
def test_a_breach_is_seen(module, source):
    assert breaches({**SMALL, module: source}) != []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("tmsopt.models.a", "from tmsopt.roots import product"),
        ("tmsopt.paper.a", "from tmsopt import laws"),
        ("tmsopt.cli", "import tmsopt"),
        ("tmsopt.laws", "import numpy"),
        ("tmsopt.files", "from tmsopt.errors import InputError"),
        ("tmsopt.search.b", "from .solve import x"),
    ],
)
def test_what_the_floors_allow_is_no_breach(module, source):
    assert breaches({**SMALL, module: source}) == []


def test_the_other_checks_see_what_they_look_for():
    assert cycles({"tmsopt": "", "tmsopt.a": "import tmsopt.b", "tmsopt.b": "def f():\n    from tmsopt import a"})
    assert not cycles({"tmsopt": "", "tmsopt.a": "import tmsopt.b", "tmsopt.b": ""})
    assert writes("def f():\n    print(1)") == [2]
    assert writes("import sys\nsys.stderr.write('x')") == [2]
    assert writes("'print(1)'  # print(1)") == []
    for call in ("p.open('wb')", "open(p, mode='a')", "p.write_text(t)", "figure.savefig(p)", "np.savez(p, a=a)"):
        assert list(written("m", f"def f():\n    {call}")) == ["m.f"]
        assert list(written("m", f"def f():\n    with write_atomic(x) as p:\n        {call}")) == []
    assert list(written("m", "def f():\n    p.open('rb')\n    open(p)\n    write_text(p, t)")) == []
    assert calls("eval('1')\nexec('1')\nmodel.eval()\nbuiltins.eval('1')", "eval", "exec") == [1, 2, 4]
    assert callers_of_solvers({"a": "import casadi as ca\nca.nlpsol('s', 'ipopt', {})", "b": "x = 1"}) == ["a"]
    assert callers_of_solvers({"a": "from casadi import nlpsol as n", "b": "import casadi\ncasadi.Opti()"}) == ["b"]

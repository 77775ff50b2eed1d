"""`tmsopt --version`: one line, and for a report of a bug all that an answer may depend on."""

import json
import platform
import re
import subprocess
import sys
import tomllib
from importlib import metadata

import pytest
from helpers.places import ROOT

import tmsopt
from tmsopt.cli import main

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_version_is_one_line(run):
    assert run("--version") == (0, f"tmsopt, version {tmsopt.__version__}\n", "")


@pytest.mark.parametrize("words", ["--version --json", "--json --version", "--version --json solve no_such_file.toml"])
def test_version_as_json_says_what_is_installed(run, words):
    status, out, err = run(*words.split())
    assert (status, err) == (0, "")
    data = json.loads(out)
    assert list(data) == ["schema", "tmsopt", "python", "implementation", "system", "machine", "packages"]
    assert (data["schema"], data["tmsopt"], data["python"]) == (1, tmsopt.__version__, platform.python_version())
    assert data["machine"] == platform.machine()
    for name, version in data["packages"].items():
        if name != "ipopt":
            there = [d.version for d in metadata.distributions(name=name)]
            assert version == (there[0] if there else None), name


def test_all_that_tmsopt_needs_or_can_use_is_listed(run):
    extras = [PROJECT["optional-dependencies"][name] for name in ("certify", "cluster", "data")]
    stated = {re.split("[<>=!~;\\[ ]", text)[0] for text in sum(extras, PROJECT["dependencies"])}
    assert set(json.loads(run("--version", "--json")[1])["packages"]) == stated | {"ipopt"}


def test_what_is_not_installed_is_null(run, monkeypatch):
    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("tmsopt.versions.version", missing)
    monkeypatch.setattr("tmsopt.versions.distribution", missing)
    data = json.loads(run("--version", "--json")[1])
    assert set(data["packages"].values()) == {None}
    assert data["tmsopt"] == tmsopt.__version__


def test_the_version_of_ipopt_is_the_one_that_solves(capfd):
    """IPOPT says it itself, in the banner of a solve."""
    import casadi

    x = casadi.SX.sym("x")
    casadi.nlpsol("s", "ipopt", {"x": x, "f": x * x}, {"print_time": False})(x0=1)
    banner = re.search(r"This is Ipopt version (\d+(?:\.\d+)+)", capfd.readouterr().out)
    with pytest.raises(SystemExit):
        main(args=["--version", "--json"], prog_name="tmsopt")
    told = json.loads(capfd.readouterr().out)["packages"]["ipopt"]
    assert told in (banner[1], None)


def test_nothing_is_loaded_for_it():
    script = (
        "import sys\nfrom tmsopt.cli import main\ntry: main(['--version', '--json'])\n"
        "except SystemExit: print(*sys.modules, file=sys.stderr)"
    )
    ended = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert json.loads(ended.stdout)["tmsopt"] == tmsopt.__version__
    assert not {"casadi", "numpy", "scipy", "matplotlib", "pydantic", "pint"} & set(ended.stderr.split())


@pytest.mark.parametrize("words", ["--json", "--json solve problems/ep4.toml"])
def test_json_alone_is_no_option_of_the_whole(run, words):
    status, out, err = run(*words.split())
    assert (status, out) == (2, "")
    assert "No such option" in err
    assert "--json" in err

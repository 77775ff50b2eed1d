"""Bicycles in the files of the BicycleParameters program: text with uncertainties, and YAML.

Text has lines such as ``rF = 0.344+/-0.0001``; several values after commas are averaged; ``#`` begins a comment. YAML
has its numbers under ``values:``, or at the top. The names are those of Meijaard et al. (2007) as that program writes
them: ``lam`` is lambda_s, ``IFyy`` is I_Fyy. ``IByy`` and ``IHyy`` have no part in the linear motion.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from os import PathLike

from tmsopt.errors import Fault, InputError, escape_unprintable, limit_advice, short, suggest
from tmsopt.files import as_path, read_text, write_text
from tmsopt.models.bicycles.whipple import whipple
from tmsopt.records import Table

_OF = whipple.sets[0]
_WRITTEN = {p.name: "lam" if p.name == "lambda_s" else p.name.replace("_", "") for p in _OF.parameters}
_OWN = {written: name for name, written in _WRITTEN.items()}
_NO_PART = ("IByy", "IHyy", "yB", "yH", "yR", "yF")
"""Names that the files have and the linear motion does not depend on."""

_ASIDE = (
    *("IRzz", "IFzz"),  # of round wheels: IRxx, IFxx
    *("d1", "d2", "d3"),  # the geometry again, as others state it
    *("xcl", "zcl"),  # where a sideways force acts
    *(f"{of}{part}" for part in "GS" for of in ("m", "x", "z")),  # handlebar and fork, which H has together
    *(f"I{part}{axes}" for part in "GS" for axes in ("xx", "yy", "zz", "xz")),
)
"""Names that only some files have; these say nothing more of the linear motion."""

_OPTIONAL = ("v", "g")
_YAML = (".yml", ".yaml")
_TEXT = (".txt", ".ini")
_KINDS = ("benchmark", "meijaard2007")

_NUMBER = r"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?"
_MEASURED = re.compile(
    rf"\(?\s*+(?P<value>{_NUMBER})\s*+(?:(?:\+/-|±)\s*+(?P<off>{_NUMBER})\s*+)?\)?(?P<power>[eE][+-]?\d++)?"
)


@dataclass(frozen=True)
class Bicycle:
    """A bicycle as measured.

    Attributes:
        name: of the file.
        parameters: those of the model ``whipple`` that the file gives, in SI units and radians; not always the speed.
        uncertainties: standard deviations of those that have one above 0.
        others: what the linear motion does not depend on, by its name in the file.

    Example:
        >>> bicycle = tmsopt.Bicycle("mine", {"w": 1.02, "m_B": 85.0}, uncertainties={"w": 0.005})
        >>> bicycle.tolerances()  # two standard deviations
        {'w': 0.01}

    More: docs/how_to/import.md
    """

    name: str
    parameters: Table[float]
    uncertainties: Table[float] = Table()
    others: Table[float] = Table()

    def tolerances(self, deviations: float = 2.0, most: int = 8) -> dict[str, float]:
        """Tolerances of a problem: so many standard deviations of the parameters that are least certain, relatively."""
        share = {n: u / (abs(self.parameters[n]) or math.inf) for n, u in self.uncertainties.items()}
        chosen = sorted(share, key=lambda n: -share[n])[:most]
        return {n: deviations * self.uncertainties[n] for n in self.parameters if n in chosen}


def read_bicycle(path: str | PathLike[str]) -> Bicycle:
    """Read a parameter file of BicycleParameters, such as ``BrowserBenchmark.txt`` or ``benchmark-browser.yml``.

    Raises:
        InputError: listing every line that is not understood, names that are unknown, and names that are missing.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> design = tmsopt.load("problems/whipple_benchmark.toml").fixed
        >>> with TemporaryDirectory() as folder:
        ...     tmsopt.write_bicycle(design, f"{folder}/benchmark.txt")
        ...     tmsopt.read_bicycle(f"{folder}/benchmark.txt").parameters["lambda_s"] == design["lambda_s"]
        True

    More: docs/how_to/import.md
    """
    file = as_path(path, "a file of bicycle parameters")
    kind = "YAML" if file.suffix.lower() in _YAML else "TXT"
    text = read_text(str(path), f"{kind} file of bicycle parameters")
    entries = list(_entries(text, kind == "YAML"))
    faults, found, off, others = [], {}, {}, {}
    advice = limit_advice(suggest)
    for number, name, written in entries:
        numbers = _numbers(written)
        if kind == "YAML" and name == "parameterization":
            if written.strip("'\" ").lower() not in _KINDS:
                message = f"found the parameterization {short(written)}; accepted: Meijaard2007 or benchmark"
                faults.append(Fault(message).at(str(path), number))
        elif name not in _OWN and name not in _NO_PART + _ASIDE:
            message = f"unknown name {short(name)}; {advice(name, [*_OWN, *_NO_PART])}"
            faults.append(Fault(message).at(str(path), number))
        elif numbers is None:
            message = (
                f"{name}: found {short(written)}; accepted: a number, with +/- its uncertainty, or several after commas"
            )
            faults.append(Fault(message).at(str(path), number))
        elif name in _NO_PART + _ASIDE:
            others[name] = numbers[0]
        else:
            found[_OWN[name]], off[_OWN[name]] = numbers
    reported = {name for _, name, _ in entries}
    missing = [w for n, w in _WRITTEN.items() if w not in reported and n not in _OPTIONAL]
    if missing:
        raw = " These are the raw measurements; make the Benchmark file with that program." if "hbb" in reported else ""
        faults.append(Fault(f"missing: {', '.join(missing)}.{raw}", file=str(path)))
    for name, value in found.items():
        if value not in (whole := _OF[name]).range:
            message = f"{_WRITTEN[name]} = {value:.6g} is not physical; {whole.meaning} is {whole.range}"
            faults.append(Fault(message, file=str(path)))
    if faults:
        raise InputError(faults)
    ordered = {n: found[n] for n in _OF.names if n in found}
    return Bicycle(
        escape_unprintable(file.stem), Table(ordered), Table({n: off[n] for n in ordered if off[n] > 0}), Table(others)
    )


def write_bicycle(bicycle: Bicycle | Mapping[str, float], path: str | PathLike[str]) -> None:
    """Write a bicycle, or the parameters of a ``whipple`` design, for BicycleParameters, as the ending says.

    Every number is written so that it reads back the same. YAML takes no uncertainties.

    Raises:
        InputError: for another ending, or parameters that are missing.
        OSError: when the file cannot be written.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     tmsopt.write_bicycle(tmsopt.load("problems/whipple_benchmark.toml").fixed, f"{folder}/mine.yml")
        ...     tmsopt.read_bicycle(f"{folder}/mine.yml").parameters["w"]
        1.02

    More: docs/how_to/import.md
    """
    file = as_path(path, "the file to write")
    ending = file.suffix.lower()
    if ending not in (*_TEXT, *_YAML):
        raise InputError([Fault(f"found '{path}'; accepted: a file name ending in {', '.join((*_TEXT, *_YAML))}")])
    own = bicycle if isinstance(bicycle, Bicycle) else Bicycle(file.stem, Table(bicycle))
    defaults = {p.name: p.default for p in _OF.parameters if p.default is not None}
    values = {**defaults, **own.parameters}
    missing = [n for n in _OF.names if n not in values and n not in _OPTIONAL]
    if missing:
        raise InputError([Fault(f"missing parameter {', '.join(missing)}", ("parameters",))])
    rows = {written: (values[n], own.uncertainties.get(n, 0.0)) for n, written in _WRITTEN.items() if n in values}
    rows |= {n: (float(own.others.get(n, 0.0)), 0.0) for n in ("IByy", "IHyy")}
    if ending in _TEXT:
        lines = [f"{n} = {_decimal(v)}" + (f"+/-{_decimal(u)}" if u else "") for n, (v, u) in sorted(rows.items())]
    else:
        head = ["parameterization: Meijaard2007", f"parameters: {_quoted(own.name)}", "rider: null", "description: ''"]
        lines = [*head, "values:", *(f"  {n}: {_decimal(v)}" for n, (v, _) in sorted(rows.items()))]
    write_text(file, "\n".join(lines) + "\n")


def problem_text(bicycle: Bicycle, speed: float | None = None) -> str:
    """A problem file of a bicycle: every parameter fixed, at the speed given, or the file's, or else at 5 m/s.

    Example:
        >>> own = tmsopt.Bicycle("mine", tmsopt.load("problems/whipple_benchmark.toml").fixed)
        >>> "v = 6.0 " in tmsopt.models.problem_text(own, speed=6.0)
        True

    More: docs/how_to/import.md
    """
    v = speed if speed is not None else bicycle.parameters.get("v", 5.0)
    lines = [f"title = {_quoted(bicycle.name)}", 'model = "whipple"', "", "[parameters]"]
    for parameter in _OF.parameters:
        name = parameter.name
        value = v if name == "v" else bicycle.parameters.get(name, parameter.default)
        comment = f"{parameter.meaning}, {parameter.unit}"
        if name in bicycle.uncertainties:
            comment += f"; ± {bicycle.uncertainties[name]:.6g}"
        lines.append(f"{name} = {_decimal(float(value or 0.0))}  # {comment}")
    return "\n".join(lines) + "\n"


def _entries(text: str, in_yaml: bool) -> Iterator[tuple[int, str, str]]:
    """Line number, name and what is written of each line that says something.

    Of YAML the two layouts that occur: numbers under ``values:``, or all at the top.
    """
    nested, section = in_yaml and re.search(r"^values\s*:", text, re.MULTILINE), ""
    for number, line in enumerate(text.splitlines(), start=1):
        said = re.split(r"(?:^|\s)#" if in_yaml else "#", line, maxsplit=1)[0].rstrip()
        name, _, written = (part.strip() for part in said.partition(":" if in_yaml else "="))
        if in_yaml and said[:1].isspace():
            told = section == "values"
        elif said:
            section, told = name, not nested or name == "parameterization"
        if said.strip() and told:
            yield number, name, written


def _numbers(written: str) -> tuple[float, float] | None:
    """Mean of the values and its standard deviation; None for what is no number."""
    parts = [_MEASURED.fullmatch(part.strip()) for part in written.split(",")]
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    values = [float(part["value"] + (part["power"] or "")) for part in known]
    offs = [float((part["off"] or "0") + (part["power"] or "")) for part in known]
    if not all(map(math.isfinite, (*values, *offs))):
        return None
    return sum(values) / len(values), math.hypot(*offs) / len(values)


def _decimal(value: float) -> str:
    """The shortest decimal that reads back the same, with a point, as YAML asks of a float."""
    text = repr(float(value))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _quoted(text: str) -> str:
    return '"' + "".join(c for c in escape_unprintable(text) if c not in '"\\') + '"'

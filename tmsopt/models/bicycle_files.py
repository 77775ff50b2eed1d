"""Reads and writes parameter files of the BicycleParameters program: text with uncertainties, and YAML.

Text files have lines such as ``rF = 0.344+/-0.0001``. Several values between commas are averaged, and ``#`` begins a
comment. YAML files have the numbers under ``values:``, or at the top level. The names follow Meijaard et al. (2007):
``lam`` is lambda_s, and ``IFyy`` is I_Fyy. ``IByy`` and ``IHyy`` do not affect the linear motion.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike

from tmsopt.errors import Fault, InputError, escape_unprintable, limit_advice, short, suggest
from tmsopt.files import as_path, read_text, write_text
from tmsopt.models.bicycles.whipple import whipple
from tmsopt.records import Numbers, Table

_SI = whipple.sets[0]
_FILE_NAMES = {p.name: "lam" if p.name == "lambda_s" else p.name.replace("_", "") for p in _SI.parameters}
_MODEL_NAMES = {file_name: name for name, file_name in _FILE_NAMES.items()}
_NAMES_WITHOUT_EFFECT = ("IByy", "IHyy", "yB", "yH", "yR", "yF")
"""Names in the files on which the linear motion does not depend."""

_REDUNDANT_NAMES = (
    *("IRzz", "IFzz"),  # equal to IRxx, IFxx for round wheels
    *("d1", "d2", "d3"),  # other parameters of the same geometry
    *("xcl", "zcl"),  # point of action of a lateral force
    *(f"{symbol}{part}" for part in "GS" for symbol in ("m", "x", "z")),  # handlebar, fork
    *(f"I{part}{axes}" for part in "GS" for axes in ("xx", "yy", "zz", "xz")),
)
"""Names in some files that give no further information about the linear motion."""

_UNUSED_NAMES = (*_NAMES_WITHOUT_EFFECT, *_REDUNDANT_NAMES)
_OPTIONAL_NAMES = ("v", "g")
_YAML_SUFFIXES = (".yml", ".yaml")
_TEXT_SUFFIXES = (".txt", ".ini")
_PARAMETERIZATIONS = ("benchmark", "meijaard2007")

_NUMBER = r"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?"
_MEASURED = re.compile(
    rf"\(?\s*+(?P<value>{_NUMBER})\s*+(?:(?:\+/-|±)\s*+(?P<deviation>{_NUMBER})\s*+)?\)?(?P<power>[eE][+-]?\d++)?"
)


@dataclass(frozen=True)
class Bicycle:
    """A measured bicycle.

    Attributes:
        name: name of the file without its ending.
        parameters: parameters of the model ``whipple`` in SI units and radians; the speed may be missing.
        uncertainties: parameter → standard deviation, if it is above 0.
        others: name in the file → number that does not affect the linear motion.

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
        """Tolerances of `deviations` standard deviations.

        Only the `most` parameters with the largest relative deviations have one.
        """
        relative_deviations = {n: u / (abs(self.parameters[n]) or math.inf) for n, u in self.uncertainties.items()}
        names = sorted(relative_deviations, key=lambda n: -relative_deviations[n])[:most]
        return {n: deviations * self.uncertainties[n] for n in self.parameters if n in names}


def read_bicycle(path: str | PathLike[str]) -> Bicycle:
    """Read a parameter file of BicycleParameters, such as ``BrowserBenchmark.txt`` or ``benchmark-browser.yml``.

    Raises:
        InputError: if a line cannot be read, or a name is unknown or missing. The error lists all of these faults.

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
    kind = "YAML" if file.suffix.lower() in _YAML_SUFFIXES else "TXT"
    text = read_text(str(path), f"{kind} file of bicycle parameters")
    entries = list(_read_entries(text, kind == "YAML"))
    faults, parameters, deviations, other_numbers = [], {}, {}, {}
    advice = limit_advice(suggest)
    for line_number, name, value_text in entries:
        numbers, message = _parse_numbers(value_text), ""
        if kind == "YAML" and name == "parameterization":
            if value_text.strip("'\" ").lower() not in _PARAMETERIZATIONS:
                message = f"found the parameterization {short(value_text)}; accepted: Meijaard2007 or benchmark"
        elif name not in _MODEL_NAMES and name not in _UNUSED_NAMES:
            message = f"unknown name {short(name)}; {advice(name, [*_MODEL_NAMES, *_NAMES_WITHOUT_EFFECT])}"
        elif numbers is None:
            message = (
                f"{name}: found {short(value_text)}; "
                "accepted: a number, with +/- its uncertainty, or several between commas"
            )
        elif name in _UNUSED_NAMES:
            other_numbers[name], _ = numbers
        else:
            parameters[_MODEL_NAMES[name]], deviations[_MODEL_NAMES[name]] = numbers
        if message:
            faults.append(Fault(message).at(str(path), line_number))
    names_in_file = {name for _, name, _ in entries}
    if missing := [w for n, w in _FILE_NAMES.items() if w not in names_in_file and n not in _OPTIONAL_NAMES]:
        hint = "These are raw measurements; make the Benchmark file with BicycleParameters."
        message = f"missing: {', '.join(missing)}. {hint if 'hbb' in names_in_file else ''}"
        faults.append(Fault(message.strip(), file=str(path)))
    for name, value in parameters.items():
        if value not in (parameter := _SI[name]).range:
            message = f"{_FILE_NAMES[name]} = {value:.6g} is not physical"
            accepted = f"accepted: {parameter.range} ({parameter.meaning})"
            faults.append(Fault(f"{message}; {accepted}", file=str(path)))
    if faults:
        raise InputError(faults)
    ordered_parameters = {n: parameters[n] for n in _SI.names if n in parameters}
    return Bicycle(
        escape_unprintable(file.stem),
        Table(ordered_parameters),
        Table({n: deviations[n] for n in ordered_parameters if deviations[n] > 0}),
        Table(other_numbers),
    )


def write_bicycle(bicycle: Bicycle | Numbers, path: str | PathLike[str]) -> None:
    """Write a bicycle, or the parameters of a ``whipple`` design, as a BicycleParameters file.

    The ending of the name selects the format: ``.txt`` and ``.ini`` text, ``.yml`` and ``.yaml`` YAML, which has no
    uncertainties. Reading the file gives the same numbers.

    Raises:
        InputError: if the name has another ending, or parameters are missing.
        OSError: if the file cannot be written.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     tmsopt.write_bicycle(tmsopt.load("problems/whipple_benchmark.toml").fixed, f"{folder}/mine.yml")
        ...     tmsopt.read_bicycle(f"{folder}/mine.yml").parameters["w"]
        1.02

    More: docs/how_to/import.md
    """
    file = as_path(path, "the file to write")
    suffix = file.suffix.lower()
    if suffix not in (*_TEXT_SUFFIXES, *_YAML_SUFFIXES):
        accepted = f"a file name ending in {', '.join((*_TEXT_SUFFIXES, *_YAML_SUFFIXES))}"
        raise InputError([Fault(f"found '{path}'; accepted: {accepted}")])
    record = bicycle if isinstance(bicycle, Bicycle) else Bicycle(file.stem, Table(bicycle))
    defaults = {p.name: p.default for p in _SI.parameters if p.default is not None}
    values = {**defaults, **record.parameters}
    missing = [n for n in _SI.names if n not in values and n not in _OPTIONAL_NAMES]
    if missing:
        raise InputError([Fault(f"missing parameter {', '.join(missing)}", ("parameters",))])
    numbers = {w: values[n] for n, w in _FILE_NAMES.items() if n in values}
    numbers |= {n: float(record.others.get(n, 0.0)) for n in ("IByy", "IHyy")}
    deviations = {_FILE_NAMES[n]: f"+/-{_format_decimal(u)}" for n, u in record.uncertainties.items() if u}
    if suffix in _TEXT_SUFFIXES:
        lines = [f"{n} = {_format_decimal(x)}{deviations.get(n, '')}" for n, x in sorted(numbers.items())]
    else:
        name = _quote(record.name)
        head = ["parameterization: Meijaard2007", f"parameters: {name}", "rider: null", "description: ''"]
        lines = [*head, "values:", *(f"  {n}: {_format_decimal(x)}" for n, x in sorted(numbers.items()))]
    write_text(file, "\n".join(lines) + "\n")


def problem_text(bicycle: Bicycle, speed: float | None = None) -> str:
    """The text of a problem file for a bicycle with every parameter fixed.

    The speed is `speed`, or else the speed of the bicycle, or else 5 m/s.

    Example:
        >>> own = tmsopt.Bicycle("mine", tmsopt.load("problems/whipple_benchmark.toml").fixed)
        >>> "v = 6.0 " in tmsopt.models.problem_text(own, speed=6.0)
        True

    More: docs/how_to/import.md
    """
    values = {"v": 5.0, **bicycle.parameters} | ({} if speed is None else {"v": speed})
    lines = [f"title = {_quote(bicycle.name)}", 'model = "whipple"', "", "[parameters]"]
    for p in _SI.parameters:
        deviation = f"; ± {bicycle.uncertainties[p.name]:.6g}" if p.name in bicycle.uncertainties else ""
        number_text = _format_decimal(float(values.get(p.name, p.default) or 0.0))
        lines.append(f"{p.name} = {number_text}  # {p.meaning}, {p.unit}{deviation}")
    return "\n".join(lines) + "\n"


def _read_entries(text: str, in_yaml: bool) -> Iterator[tuple[int, str, str]]:
    """Line number, name and value of each entry. YAML files have the entries under ``values:``, or at the top level."""
    has_values_section, section = in_yaml and re.search(r"^values\s*:", text, re.MULTILINE), ""
    for line_number, line in enumerate(text.splitlines(), start=1):
        content = re.split(r"(?:^|\s)#" if in_yaml else "#", line, maxsplit=1)[0].rstrip()
        name, _, value_text = (part.strip() for part in content.partition(":" if in_yaml else "="))
        if in_yaml and content[:1].isspace():
            is_entry = section == "values"
        elif content:
            section, is_entry = name, not has_values_section or name == "parameterization"
        if content.strip() and is_entry:
            yield line_number, name, value_text


def _parse_numbers(value_text: str) -> tuple[float, float] | None:
    """The mean of the values and the standard deviation of the mean; None if a value is not a number."""
    values, deviations = [], []
    for part in value_text.split(","):
        if (match := _MEASURED.fullmatch(part.strip())) is None:
            return None
        power = match["power"] or ""
        values.append(float(match["value"] + power))
        deviations.append(float((match["deviation"] or "0") + power))
    if not all(map(math.isfinite, (*values, *deviations))):
        return None
    return sum(values) / len(values), math.hypot(*deviations) / len(values)


def _format_decimal(value: float) -> str:
    """The shortest decimal of a double, with a point, because YAML requires a point in a float."""
    text = repr(float(value))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _quote(text: str) -> str:
    return '"' + "".join(c for c in escape_unprintable(text) if c not in '"\\') + '"'

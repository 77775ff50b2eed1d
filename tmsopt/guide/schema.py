"""The shape of problem and study files as JSON Schema, by which editors complete, explain and check them.

Made from the shapes that read the files and from the models, in draft 2020-12. Taplo, the engine of Even Better TOML,
completes and explains by ``properties``, ``anyOf`` and ``$ref`` alone, and checks by everything.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from tmsopt.models import MODELS, Parameter, ParameterSet, controlled, gain_names
from tmsopt.models.expression import SIGN
from tmsopt.problem.files import SHAPE as PROBLEM
from tmsopt.problem.model_table import KEYS
from tmsopt.roots.patterns.composed import pattern_names
from tmsopt.studies.files import SHAPE as STUDY
from tmsopt.studies.monte_carlo import DISTRIBUTIONS
from tmsopt.studies.study import METHODS

DRAFT = "https://json-schema.org/draft/2020-12/schema"

Schema = dict[str, Any]

_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
_WITH_UNIT = rf"^\s*{_NUMBER}\s*[^\d\s.+-].*$"
_NAME = "^[A-Za-z][A-Za-z0-9_]*$"
_PART = r"(([1-9]\d*)?C?EP([2-9]|1[0-2])|weave|resonance|capsize)"
_PATTERN = rf"^\s*{_PART}(\s*\+\s*{_PART})*\s*$"
_COMPARISON = f"^[^<>=]+({SIGN.pattern})[^<>=]+$"
_OF_STUDY: Schema = {"anyOf": [{"required": [key]} for key in ("problem", "study", "vary")]}


def schema() -> Schema:
    """The JSON Schema of problem files and study files, as plain data.

    Example:
        >>> tmsopt.schema()["$schema"]
        'https://json-schema.org/draft/2020-12/schema'

    More: docs/reference/problem_file.md
    """
    problem, defs = _shape(PROBLEM)
    study, more = _shape(STUDY)
    defs |= more
    _refine_problem(problem, defs)
    _refine_study(study, defs)
    defs |= {"parameters_own": _own(defs.pop("FreeParameter"))}
    for name in MODELS:
        sets, gains = _sets(name), set(gain_names(name))
        own = [[p for p in of.parameters if p.name in gains] for of in sets]
        defs[f"feedback_{name}"] = _table(f"Gains of a controller of {name}.", own)
        defs[f"parameters_{name}"] = _table(f"Parameters of {name}.", [of.parameters for of in sets])
        defs[f"parameters_{name}"]["properties"] |= {n: _ref(f"feedback_{name}/properties/{n}") for n in sorted(gains)}
    return {
        "$schema": DRAFT,
        "title": "tmsopt",
        "description": "A problem file or a study file of tmsopt.",
        "type": "object",
        **_offer(_ref("problem"), _ref("study_file")),
        "if": _OF_STUDY,
        "then": _ref("study_file"),
        "else": _ref("problem"),
        "$defs": {**defs, "problem": problem, "study_file": study},
    }


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _offer(*several: Schema) -> Schema:
    """What an editor may offer, without a word on what is wrong: the last one always holds."""
    return {"anyOf": [*several, {}]}


def _either(*kinds: Schema) -> Schema:
    """Schemas of different types as one: each keyword is for its type, and a fault is told at its place."""
    return {key: value for kind in kinds for key, value in kind.items()} | {"type": [kind["type"] for kind in kinds]}


def _shape(of: Any) -> tuple[Schema, dict[str, Schema]]:
    """The schema of a pydantic shape, without titles and nulls, and the shapes that it refers to."""
    whole = _plain(of.model_json_schema())
    defs = {name.strip("_"): inner for name, inner in whole.pop("$defs", {}).items()}
    return whole, defs


def _plain(node: Any) -> Any:
    match node:
        case str():
            return node.replace("#/$defs/_", "#/$defs/")
        case list():
            return [_plain(inner) for inner in node]
        case dict():
            titled = isinstance(node.get("title"), str)
            left = {k: _plain(v) for k, v in node.items() if not (k == "title" and titled)}
        case _:
            return node
    if left.get("default", "") is None:
        del left["default"]
    if "anyOf" in left:
        kinds = [kind for kind in left.pop("anyOf") if kind != {"type": "null"}]
        if all(set(kind) == {"type"} for kind in kinds):
            names = [kind["type"] for kind in kinds]
            names = [n for n in names if n != "integer" or "number" not in names]  # number takes in integer
            return left | {"type": names[0] if len(names) == 1 else names}
        left |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
    return left


def _refine_problem(problem: Schema, defs: dict[str, Schema]) -> None:
    """What the shape leaves open: names of models, patterns and parameters, and what goes with what."""
    keys, objective, band = problem["properties"], defs.pop("Objective"), defs.pop("Band")
    for shape in (defs["FreeParameter"], band):
        for end in ("min", "max", "start"):
            shape["properties"].get(end, {})["pattern"] = _WITH_UNIT
    band["properties"]["points"] |= {"minimum": 2, "maximum": 99}
    objective["properties"]["locate"] |= {**_offer({"enum": list(pattern_names(4))}), "pattern": _PATTERN}
    objective["properties"]["pareto"] |= {"minItems": 2, "maxItems": 3, "uniqueItems": True}
    objective["not"] = {"required": ["minimize", "maximize"]}
    keys["objective"] = {"description": objective["description"], **objective}
    keys["constraints"]["additionalProperties"] = {"type": "string", "pattern": _COMPARISON}
    titles = "; ".join(f"{model.name}: {model.title}" for model in MODELS.values())
    keys["model"] = {
        "description": f"{keys['model']['description']} {titles}.",
        "default": "tms",
        **_offer({"enum": list(MODELS)}),
        "if": {"type": "string"},
        "then": {"enum": list(MODELS)},
        "else": _model_table(),
    }
    for table, own in (("parameters", ["own"]), ("feedback", [])):
        offered = _offer(*(_ref(f"{table}_{name}") for name in (*MODELS, *own)))
        keys[table] = {"description": keys[table]["description"], "type": "object", **offered}
    _, listed = keys["scenarios"]["additionalProperties"]["anyOf"]
    keys["scenarios"]["additionalProperties"] = _either(band, listed)
    del problem["required"]  # of parameters, which a measured bicycle has in its own file
    problem["if"] = {"required": ["bicycle"]}
    problem["then"] = _with_names("whipple")
    problem["else"] = {"required": ["parameters"], **_by_model([name for name in MODELS if name != "tms"])}


def _by_model(names: list[str]) -> Schema:
    """Which names and values a file may use, by its model; tms where it names none."""
    if not names:
        return {
            "if": {"properties": {"model": {"type": "object"}}, "required": ["model"]},
            "then": {"properties": {"parameters": _ref("parameters_own"), "feedback": {"maxProperties": 0}}},
            "else": _with_names("tms"),
        }
    named = {"properties": {"model": {"const": names[0]}}, "required": ["model"]}
    return {"if": named, "then": _with_names(names[0]), "else": _by_model(names[1:])}


def _with_names(model: str) -> Schema:
    accepted = {"propertyNames": {"enum": list(dict.fromkeys(n for of in _sets(model) for n in of.names))}}
    tables = dict.fromkeys(("scenarios", "tolerances", "weights"), accepted)
    own = {"parameters": _ref(f"parameters_{model}"), "feedback": _ref(f"feedback_{model}")}
    return {"properties": {**own, **tables}}


def _sets(model: str) -> tuple[ParameterSet, ...]:
    """With all that a controller may have, which may stand in [parameters] too."""
    return controlled(MODELS[model], gain_names(model)).sets


def _table(description: str, sets: Sequence[Sequence[Parameter]]) -> Schema:
    """A table of parameters; sets are not mixed."""
    names = [[p.name for p in of] for of in sets]
    accepted: Schema = _only(names[-1])
    for k, of in reversed(list(enumerate(names[:-1]))):
        others = {n for j, other in enumerate(names) if j != k for n in other}
        named = {"anyOf": [{"required": [n]} for n in of if n not in others]}
        accepted = {"if": named, "then": _only(of), "else": accepted}
    properties = {p.name: _parameter(p) for of in sets for p in of}
    closed = {"properties": properties, "additionalProperties": False}
    return {"description": description, "type": "object", **accepted, **closed}


def _only(names: Iterable[str]) -> Schema:
    return {"properties": dict.fromkeys(names, True), "additionalProperties": False}


def _parameter(p: Parameter) -> Schema:
    """A number, a text with a unit, or a table that frees it: each keyword is for the one that it fits."""
    limits = ("minimum", "maximum") if p.range.closed else ("exclusiveMinimum", "exclusiveMaximum")
    ends = zip(limits, (p.range.lower, p.range.upper), strict=True)
    kinds, unit, pattern = ["number"], "", {}
    if p.unit != "1":
        kinds, unit, pattern = ["number", "string"], f", in {p.unit} or a text with a unit", {"pattern": _WITH_UNIT}
    value: Schema = {"type": kinds, **{key: end for key, end in ends if math.isfinite(end)}, **pattern}
    left_out = "" if p.default is None else f" {p.default:g} if left out."
    free = {
        "properties": {end: {"description": f"The {what}.", **value} for end, what in _ENDS.items()},
        "required": ["min", "max"],
        "additionalProperties": False,
    }
    return {"description": f"{p.meaning}{unit}.{left_out}", **value, "type": [*kinds, "object"], **free}


_ENDS = {"min": "least value", "max": "greatest value", "start": "value to start the search from, among others"}


def _own(free: Schema) -> Schema:
    """Parameters of a system of one's own: any names, numbers without unit."""
    return {
        "description": "Parameters of a system of your own: the names in its expressions.",
        "type": "object",
        "propertyNames": {"pattern": _NAME},
        "additionalProperties": _either({"type": "number"}, free),
    }


def _model_table() -> Schema:
    """The table [model]."""
    entry = {"type": ["number", "string"]}
    rows = {"type": "array", "items": {"type": "array", "items": entry, "minItems": 1}, "minItems": 1}
    shapes: dict[str, Schema] = {
        "name": {"type": "string"},
        "coefficients": {"type": "array", "items": entry, "minItems": 2},
        "quantities": {"type": "object", "additionalProperties": {"type": "string"}},
    }
    properties = {key: {"description": text, **shapes.get(key, rows)} for key, text in KEYS.items()}
    return {"type": "object", "properties": properties, "additionalProperties": False, "minProperties": 1}


def _refine_study(study: Schema, defs: dict[str, Schema]) -> None:
    keys = study["properties"]
    options = defs.pop("Options")
    options["properties"]["method"]["enum"] = list(METHODS)
    options["properties"]["distribution"]["enum"] = list(DISTRIBUTIONS)
    for key, least in (("rows", 1), ("starts", 1), ("seed", 0)):
        options["properties"][key]["minimum"] = least
    keys["study"] = {"description": keys["study"]["description"], **options}
    keys["problem"] = {
        "description": keys["problem"]["description"],
        **_offer(_ref("problem")),
        "if": {"type": "object"},
        "then": _ref("problem"),
        "else": {"type": "string"},
    }
    number: Schema = {"type": ["number", "string"]}
    axis = {
        "type": "object",
        "required": ["min", "max"],
        "additionalProperties": False,
        "properties": {
            "min": {"description": "The least value.", **number},
            "max": {"description": "The greatest value.", **number},
            "points": {"description": "How many values, of a grid.", "type": "integer", "minimum": 2},
            "log": {"description": "Whether steps are equal factors.", "type": "boolean"},
        },
    }
    values = _either({"type": "array", "items": number}, axis)
    inner = {"type": "object", "propertyNames": {"enum": ["min", "max", "limit"]}, "additionalProperties": values}
    keys["vary"]["additionalProperties"] = {"anyOf": [values, inner]}  # lambda_s.max without quotes is a table

"""The JSON Schema of problem and study files, with which editors complete, explain and check them.

The schema is made from the pydantic classes that read the files and from the models, in draft 2020-12. Taplo, the
engine of Even Better TOML, uses every keyword to check a file, but only ``properties``, ``anyOf`` and ``$ref`` to
complete and explain it.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from tmsopt.models import MODELS, Parameter, ParameterSet, controlled, gain_names
from tmsopt.models.expression import SIGN
from tmsopt.problem.files import FILE_SCHEMA as PROBLEM_SCHEMA
from tmsopt.problem.model_table import KEYS
from tmsopt.roots.patterns.composed import pattern_names
from tmsopt.studies.files import FILE_SCHEMA as STUDY_SCHEMA
from tmsopt.studies.monte_carlo import DISTRIBUTIONS
from tmsopt.studies.study import METHODS

DRAFT = "https://json-schema.org/draft/2020-12/schema"

Schema = dict[str, Any]

_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
_WITH_UNIT = rf"^\s*{_NUMBER}\s*[^\d\s.+-].*$"
_NAME = "^[A-Za-z][A-Za-z0-9_]*$"
_PATTERN_PART = r"(([1-9]\d*)?C?EP([2-9]|1[0-2])|weave|resonance|capsize)"
_PATTERN = rf"^\s*{_PATTERN_PART}(\s*\+\s*{_PATTERN_PART})*\s*$"
_COMPARISON = f"^[^<>=]+({SIGN.pattern})[^<>=]+$"
_IS_STUDY: Schema = {"anyOf": [{"required": [key]} for key in ("problem", "study", "vary")]}


def schema() -> Schema:
    """Return the JSON Schema of problem files and study files, as plain data.

    Example:
        >>> tmsopt.schema()["$schema"]
        'https://json-schema.org/draft/2020-12/schema'

    More: docs/reference/problem_file.md
    """
    problem, defs = _read_class(PROBLEM_SCHEMA)
    study, study_defs = _read_class(STUDY_SCHEMA)
    defs |= study_defs
    _refine_problem(problem, defs)
    _refine_study(study, defs)
    defs |= {"parameters_own": _describe_user_parameters(defs.pop("FreeParameter"))}
    for name in MODELS:
        sets, gains = _find_sets(name), set(gain_names(name))
        gain_sets = [[p for p in parameter_set.parameters if p.name in gains] for parameter_set in sets]
        defs[f"feedback_{name}"] = _describe_table(f"Gains of a controller of {name}.", gain_sets)
        defs[f"parameters_{name}"] = _describe_table(
            f"Parameters of {name}.", [parameter_set.parameters for parameter_set in sets]
        )
        defs[f"parameters_{name}"]["properties"] |= {
            n: _refer_to(f"feedback_{name}/properties/{n}") for n in sorted(gains)
        }
    return {
        "$schema": DRAFT,
        "title": "tmsopt",
        "description": "A problem file or a study file of tmsopt.",
        "type": "object",
        **_suggest(_refer_to("problem"), _refer_to("study_file")),
        "if": _IS_STUDY,
        "then": _refer_to("study_file"),
        "else": _refer_to("problem"),
        "$defs": {**defs, "problem": problem, "study_file": study},
    }


def _refer_to(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _suggest(*schemas: Schema) -> Schema:
    """Offer completions to an editor without a check: the empty schema at the end accepts everything."""
    return {"anyOf": [*schemas, {}]}


def _merge_types(*kinds: Schema) -> Schema:
    """Merge schemas of different types; each keyword applies to one type, so that editors show faults in place."""
    return {key: value for kind in kinds for key, value in kind.items()} | {"type": [kind["type"] for kind in kinds]}


def _read_class(section: Any) -> tuple[Schema, dict[str, Schema]]:
    """Return the schema of a pydantic class, without titles and nulls, and the schemas that it refers to."""
    model_schema = _simplify(section.model_json_schema())
    defs = {name.strip("_"): inner for name, inner in model_schema.pop("$defs", {}).items()}
    return model_schema, defs


def _simplify(node: Any) -> Any:
    """Simplify a schema of pydantic: without titles, nulls and underscores, and with lists of simple types."""
    match node:
        case str():
            return node.replace("#/$defs/_", "#/$defs/")
        case list():
            return [_simplify(inner) for inner in node]
        case dict():
            has_title = isinstance(node.get("title"), str)
            result = {k: _simplify(v) for k, v in node.items() if not (k == "title" and has_title)}
        case _:
            return node
    if result.get("default", "") is None:
        del result["default"]
    if "anyOf" in result:
        kinds = [kind for kind in result.pop("anyOf") if kind != {"type": "null"}]
        if all(set(kind) == {"type"} for kind in kinds):
            names = [kind["type"] for kind in kinds]
            names = [n for n in names if n != "integer" or "number" not in names]  # a number may be an integer
            return result | {"type": names[0] if len(names) == 1 else names}
        result |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
    return result


def _refine_problem(problem: Schema, defs: dict[str, Schema]) -> None:
    """Add the names of models, patterns and parameters, and which keys belong together."""
    keys, objective, band = problem["properties"], defs.pop("Objective"), defs.pop("Band")
    for inline_table in (defs["FreeParameter"], band):
        for end in ("min", "max", "start"):
            inline_table["properties"].get(end, {})["pattern"] = _WITH_UNIT
    band["properties"]["points"] |= {"minimum": 2, "maximum": 99}
    objective["properties"]["locate"] |= {**_suggest({"enum": list(pattern_names(4))}), "pattern": _PATTERN}
    objective["properties"]["pareto"] |= {"minItems": 2, "maxItems": 3, "uniqueItems": True}
    objective["not"] = {"required": ["minimize", "maximize"]}
    keys["objective"] = {"description": objective["description"], **objective}
    keys["constraints"]["additionalProperties"] = {"type": "string", "pattern": _COMPARISON}
    titles = "; ".join(f"{model.name}: {model.title}" for model in MODELS.values())
    keys["model"] = {
        "description": f"{keys['model']['description']} {titles}.",
        "default": "tms",
        **_suggest({"enum": list(MODELS)}),
        "if": {"type": "string"},
        "then": {"enum": list(MODELS)},
        "else": _describe_model(),
    }
    for table, extra_names in (("parameters", ["own"]), ("feedback", [])):
        suggestions = _suggest(*(_refer_to(f"{table}_{name}") for name in (*MODELS, *extra_names)))
        keys[table] = {"description": keys[table]["description"], "type": "object", **suggestions}
    _, value_list = keys["scenarios"]["additionalProperties"]["anyOf"]
    keys["scenarios"]["additionalProperties"] = _merge_types(band, value_list)
    del problem["required"]  # parameters may be missing if they are in the file of a measured bicycle
    problem["if"] = {"required": ["bicycle"]}
    problem["then"] = _allow_names("whipple")
    problem["else"] = {"required": ["parameters"], **_choose_by_model([name for name in MODELS if name != "tms"])}


def _choose_by_model(names: list[str]) -> Schema:
    """Choose the names and values that a file may use by its model; the default is tms."""
    if not names:
        return {
            "if": {"properties": {"model": {"type": "object"}}, "required": ["model"]},
            "then": {"properties": {"parameters": _refer_to("parameters_own"), "feedback": {"maxProperties": 0}}},
            "else": _allow_names("tms"),
        }
    condition = {"properties": {"model": {"const": names[0]}}, "required": ["model"]}
    return {"if": condition, "then": _allow_names(names[0]), "else": _choose_by_model(names[1:])}


def _allow_names(model: str) -> Schema:
    names = list(dict.fromkeys(n for parameter_set in _find_sets(model) for n in parameter_set.names))
    tables = {table: {"propertyNames": {"enum": names}} for table in ("scenarios", "tolerances", "weights")}
    parameter_tables = {"parameters": _refer_to(f"parameters_{model}"), "feedback": _refer_to(f"feedback_{model}")}
    return {"properties": {**parameter_tables, **tables}}


def _find_sets(model: str) -> tuple[ParameterSet, ...]:
    """Return the parameter sets with all gains of a controller, which [parameters] may contain too."""
    return controlled(MODELS[model], gain_names(model)).sets


def _describe_table(description: str, sets: Sequence[Sequence[Parameter]]) -> Schema:
    """Describe a table with the parameters of one of the sets."""
    names = [[p.name for p in members] for members in sets]
    accepted: Schema = _allow_only(names[-1])
    for k, members in reversed(list(enumerate(names[:-1]))):
        other_names = {n for j, other in enumerate(names) if j != k for n in other}
        condition = {"anyOf": [{"required": [n]} for n in members if n not in other_names]}
        accepted = {"if": condition, "then": _allow_only(members), "else": accepted}
    properties = {p.name: _describe_parameter(p) for members in sets for p in members}
    return {
        "description": description,
        "type": "object",
        **accepted,
        "properties": properties,
        "additionalProperties": False,
    }


def _allow_only(names: Iterable[str]) -> Schema:
    return {"properties": dict.fromkeys(names, True), "additionalProperties": False}


def _describe_parameter(p: Parameter) -> Schema:
    """Describe a parameter: a number, a text with a unit, or a table with bounds. Each keyword applies to one type."""
    limits = ("minimum", "maximum") if p.range.closed else ("exclusiveMinimum", "exclusiveMaximum")
    ends = zip(limits, (p.range.lower, p.range.upper), strict=True)
    kinds, unit, pattern = ["number"], "", {}
    if p.unit != "1":
        kinds, unit, pattern = ["number", "string"], f", in {p.unit} or a text with a unit", {"pattern": _WITH_UNIT}
    value: Schema = {"type": kinds, **{key: end for key, end in ends if math.isfinite(end)}, **pattern}
    default_text = "" if p.default is None else f" {p.default:g} if left out."
    bounds = {
        "properties": {end: {"description": f"The {meaning}.", **value} for end, meaning in _ENDS.items()},
        "required": ["min", "max"],
        "additionalProperties": False,
    }
    return {"description": f"{p.meaning}{unit}.{default_text}", **value, "type": [*kinds, "object"], **bounds}


_ENDS = {"min": "least value", "max": "greatest value", "start": "value to start the search from, among others"}


def _describe_user_parameters(free: Schema) -> Schema:
    """Describe the parameters of a user's system: any names, numbers without units."""
    return {
        "description": "Parameters of a system of your own: the names in its expressions.",
        "type": "object",
        "propertyNames": {"pattern": _NAME},
        "additionalProperties": _merge_types({"type": "number"}, free),
    }


def _describe_model() -> Schema:
    """Describe the table [model]."""
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
    for key, minimum in (("rows", 1), ("starts", 1), ("seed", 0)):
        options["properties"][key]["minimum"] = minimum
    keys["study"] = {"description": keys["study"]["description"], **options}
    keys["problem"] = {
        "description": keys["problem"]["description"],
        **_suggest(_refer_to("problem")),
        "if": {"type": "object"},
        "then": _refer_to("problem"),
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
    values = _merge_types({"type": "array", "items": number}, axis)
    inner = {"type": "object", "propertyNames": {"enum": ["min", "max", "limit"]}, "additionalProperties": values}
    keys["vary"]["additionalProperties"] = {"anyOf": [values, inner]}  # lambda_s.max without quotes is a table

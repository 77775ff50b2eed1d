"""Lists every name that an expression may use, with its meaning, and suggests one for an unknown name."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from operator import itemgetter

from tmsopt.errors import find_similar, suggest
from tmsopt.models import MODELS, Model, Parameter, ParameterSet, Quantity
from tmsopt.models.tables import read_table
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, ROOT_QUANTITIES, root_names

_MIN_SIMILARITY = 0.7  # if no name is at least this similar to an unknown name, the meanings are searched first

_EXAMPLES = (
    (1.0, 0.5, 2.0),
    (-1.0, -2.0, -0.5),
    (0.5, 0.2, 1.0),
)  # (value, least, greatest); the first example in the range of a parameter is used


def vocabulary(model: Model, parameter_set: ParameterSet) -> dict[str, Parameter | Quantity]:
    """Every name that an expression may use, in the order of the documentation."""
    native = () if parameter_set is model.sets[0] else model.sets[0].parameters
    words = {0: "constant coefficient", 1: "coefficient of s"}
    entries: dict[str, Parameter | Quantity] = {}
    for k, n in zip(range(model.degree, -1, -1), model.coefficient_names(), strict=False):
        meaning = f"{words.get(k, f'coefficient of s^{k}')} in the characteristic polynomial"
        entries[n] = Quantity(n, "", meaning, f"a_{{{model.degree - k}}}", itemgetter(n))
    derived_quantities = (*model.quantities, *parameter_set.quantities, *ROOT_QUANTITIES, NO_RADIUS)
    entries |= {p.name: p for p in (*native, *parameter_set.parameters)} | {q.name: q for q in derived_quantities}
    if model.is_complex:
        entries["abscissa"] = replace(ROOT_QUANTITIES[0], meaning="largest Im omega, gain less loss")
    names = (*parameter_set.names, *model.quantity_names(parameter_set), *root_names(model))
    return {name: entries[name] for name in names}


def suggest_name(name: str, model: Model, parameter_set: ParameterSet, accepted: Iterable[str] | None = None) -> str:
    """Suggest a name instead of an unknown name, by its spelling or by its meaning."""
    if name in model.absent:
        return model.absent[name]
    if name == "s" and accepted is None:
        return f"s is the eigenvalue: write abscissa for the largest Re s, {ANGULAR_FREQUENCY} for the largest |Im s|"
    if meaning := _suggest_model(name, model):
        return meaning
    entries = vocabulary(model, parameter_set)
    names = list(entries if accepted is None else accepted)
    if not find_similar(name.lower(), [n.lower() for n in names], _MIN_SIMILARITY):
        words = name.lower().replace("_", " ")
        for n in names:
            meaning = entries[n].meaning.lower()
            if len(words) > 3 and (words in meaning or words.replace(" ", "") in meaning.replace(" ", "")):
                return f"write {n} ({entries[n].meaning}); accepted: {' '.join(names)}"
    return suggest(name, names)


def _suggest_model(name: str, model: Model) -> str:
    """The advice to use another bicycle model that has the name; empty if there is none."""
    for candidate in MODELS.values() if model.name in MODELS else ():
        meanings = {p.name: p.meaning for s in candidate.sets for p in s.parameters}
        quantities = (*candidate.quantities, *(q for s in candidate.sets for q in s.quantities))
        meanings |= {q.name: q.meaning for q in quantities}
        if candidate.name != model.name and name in meanings:
            return f'model = "{candidate.name}" has it ({meanings[name]}), {model.name} does not'
    return ""


def example_of(parameter: Parameter) -> tuple[str, str]:
    """A valid value and a valid range of a parameter, as lines of a file."""
    value, low, high = next(numbers for numbers in _EXAMPLES if all(x in parameter.range for x in numbers))
    return f"{parameter.name} = {value}", f"{parameter.name} = {{ min = {low:g}, max = {high:g} }}"


def suggest_key(key: str, accepted: Mapping[str, object], section: str = "file") -> str:
    """Suggest a key instead of an unknown key of a section, or of the file itself."""
    replacement = read_table("advice")["keys"][section].get(key.lower())
    hint = f"write {f'[{replacement}]' if section == 'file' else replacement}; " if replacement else ""
    return hint + suggest(key, accepted)

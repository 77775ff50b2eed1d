"""Lists every name that an expression may use, with its meaning, and suggests one for an unknown name."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from operator import itemgetter

from tmsopt.errors import nearest, suggest
from tmsopt.models import MODELS, Model, Parameter, ParameterSet, Quantity
from tmsopt.models.tables import read_table
from tmsopt.models.user_spectrum import public_names
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, ROOT_QUANTITIES, root_names

_NEAR = 0.7  # similarity of a misspelt name; below it, meanings are searched first

_EXAMPLES = (
    (1.0, 0.5, 2.0),
    (-1.0, -2.0, -0.5),
    (0.5, 0.2, 1.0),
)  # value, least, greatest; the first valid one is used


def vocabulary(model: Model, of: ParameterSet) -> dict[str, Parameter | Quantity]:
    """Every name that an expression may use, in the order of the documentation."""
    native = () if of is model.sets[0] else model.sets[0].parameters
    words = {0: "constant coefficient", 1: "coefficient of s"}
    known: dict[str, Parameter | Quantity] = {}
    for k, n in zip(range(model.degree, -1, -1), model.coefficient_names(), strict=True):
        meaning = f"{words.get(k, f'coefficient of s^{k}')} in the characteristic polynomial"
        known[n] = Quantity(n, "", meaning, f"a_{{{model.degree - k}}}", itemgetter(n))
    derived = (*model.quantities, *of.quantities, *ROOT_QUANTITIES, NO_RADIUS)
    known |= {p.name: p for p in (*native, *of.parameters)} | {q.name: q for q in derived}
    if model.carrier is not None:
        known["abscissa"] = replace(ROOT_QUANTITIES[0], meaning="largest Im omega, gain less loss")
    return {name: known[name] for name in (*of.names, *public_names(model, of), *root_names(model))}


def suggest_name(name: str, model: Model, of: ParameterSet, accepted: Iterable[str] | None = None) -> str:
    """Suggest a name for an unknown one, by spelling or by meaning."""
    if name in model.absent:
        return model.absent[name]
    if name == "s" and accepted is None:
        return f"s is the eigenvalue: write abscissa for the largest Re s, {ANGULAR_FREQUENCY} for the largest |Im s|"
    if meaning := _suggest_model(name, model):
        return meaning
    known = vocabulary(model, of)
    names = list(known if accepted is None else accepted)
    if not nearest(name.lower(), [n.lower() for n in names], _NEAR):
        words = name.lower().replace("_", " ")
        for n in names:
            meaning = known[n].meaning.lower()
            if len(words) > 3 and (words in meaning or words.replace(" ", "") in meaning.replace(" ", "")):
                return f"write {n} ({known[n].meaning}); accepted: {' '.join(names)}"
    return suggest(name, names)


def _suggest_model(name: str, model: Model) -> str:
    """Suggest the bicycle model that has a name; empty if none has."""
    for other in MODELS.values() if model.name in MODELS else ():
        known = {p.name: p.meaning for s in other.sets for p in s.parameters}
        known |= {q.name: q.meaning for q in (*other.quantities, *(q for s in other.sets for q in s.quantities))}
        if other.name != model.name and name in known:
            return f'model = "{other.name}" has it ({known[name]}), {model.name} does not'
    return ""


def example_of(parameter: Parameter) -> tuple[str, str]:
    """A valid value and a valid range of a parameter, as lines of a file."""
    value, low, high = next(u for u in _EXAMPLES if all(x in parameter.range for x in u))
    return f"{parameter.name} = {value}", f"{parameter.name} = {{ min = {low:g}, max = {high:g} }}"


def suggest_key(key: str, accepted: Mapping[str, object], section: str = "file") -> str:
    """Suggest a key for an unknown one of a section or of the file itself."""
    meant = read_table("advice")["keys"][section].get(key.lower())
    written = f"write {f'[{meant}]' if section == 'file' else meant}; " if meant else ""
    return written + suggest(key, accepted)

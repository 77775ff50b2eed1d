"""Advice: what is told to write, to ask for or to expect, obeyed to the letter or held against a closed form."""

import re
from collections.abc import Callable, Mapping

from benchmarks.suites.statements.case import Answer, Case

_SKATES = {
    "w": "80 cm",
    "v": "4 m/s",
    "m_B": 20,
    "m_H": 2,
    "x_B": {"min": "20 cm", "max": "100 cm"},
    "z_B": -0.4,
    "x_H": 0.8,
    "z_H": -0.25,
    "lambda_s": {"min": "2 deg", "max": "35 deg"},
}
_COMPACT = {
    "chi_H": 1.0,
    "zeta_H": -0.2,
    "zeta_B": -0.4,
    "mu": 0.1,
    "chi_B": {"min": 1.01, "max": 5},
    "Fr": {"min": 0.01, "max": 10},
    "lambda_s": {"min": "1 deg", "max": "80 deg"},
}

OBEY = """
import re, subprocess, sys, tomllib
from pathlib import Path
import tmsopt
from tmsopt.analysis import infeasible_sentences

def again(text):
    Path("again.toml").write_text(text)
    return tmsopt.solve("again.toml", throw=False)

text = Path("problem.toml").read_text()
try:
    found = again(text)
except tmsopt.InputError as error:
    wanted = re.search(r"write e.g. (\\w+ = [-.\\d]+)", str(error))[1]
    for advised in (wanted, re.search(r"or (\\w+ = {.*?})", str(error))[1]):
        try:
            again(text.replace("[parameters]", "[parameters]\\n" + advised))
        except tmsopt.InputError as error:
            sys.exit(f"refused: {error}")
    print("helps")
    sys.exit()
for line in infeasible_sentences(found, full=True):
    head = re.match(r"smallest change found: |  or alone: ", line)
    if not head:
        continue
    changed = text
    for part in line[head.end():].split(" and "):
        limit = re.fullmatch(r"(.+?) instead of \\S+ \\((\\w+).*\\)", part)
        end = re.fullmatch(r"(\\w+) (up|down) to (\\S+) instead of \\S+", part)
        if limit:
            changed = re.sub(rf'(?m)^{limit[2]} = ".*"$', f'{limit[2]} = "{limit[1]}"', changed)
        else:
            key = "max" if end[2] == "up" else "min"
            changed = re.sub(rf"(?m)^({end[1]} = .*{key} = )[-.\\d]+", rf"\\g<1>{end[3]}", changed)
    try:
        solved = again(changed)
    except tmsopt.InputError as error:
        sys.exit(f"refused: {error}")
    if changed == text or solved.status != "optimal" or not solved.stable:
        sys.exit(f"{line} -> {solved.status}, stable: {solved.stable}")
print("helps")
"""
"""Does what the answer says, and solves again."""

MORE = """
import re, subprocess, sys
run = lambda *asked: subprocess.run([sys.executable, "-m", "tmsopt", *asked], capture_output=True, text=True)
out = run("solve", "problem.toml").stdout
named = re.search(r"more: --full(?:; then tmsopt (.*?) with the same file)?", out)[1] or ""
for command in filter(None, named.split(", ")):
    if command not in ("chart", "trace"):
        continue
    ended = run(command, "problem.toml", *(["--points", "9"] if command == "chart" else []))
    if ended.returncode:
        sys.exit(f"{command}: {ended.stderr or ended.stdout}")
print("helps")
"""
"""Runs the commands that a report names, where they look at ranges."""


def _file(
    parameters: Mapping[str, object], objective: str, limits: Mapping[str, str] | None = None, head: str = ""
) -> str:
    def written(value: object) -> str:
        if isinstance(value, dict):
            return "{ " + ", ".join(f"{k} = {written(v)}" for k, v in value.items()) + " }"
        return f'"{value}"' if isinstance(value, str) else str(value)

    lines = [head, "[parameters]", *(f"{n} = {written(x)}" for n, x in parameters.items()), "[objective]", objective]
    lines += ["[constraints]", *(f'{n} = "{text}"' for n, text in limits.items())] if limits else []
    return "\n".join([*lines, ""])


def _polynomial(*coefficients: object) -> str:
    return f"[model]\ncoefficients = [{', '.join(str(c) if isinstance(c, int) else repr(c) for c in coefficients)}]"


def _without(table: Mapping[str, object], name: str) -> dict[str, object]:
    return {n: x for n, x in table.items() if n != name}


def _helps(answer: Answer) -> str:
    return "" if answer.stdout.strip() == "helps" else (answer.stdout + answer.stderr).strip()[-200:] or "nothing"


def _says(*words: str, never: str = "") -> Callable[[Answer], str]:
    def judge(answer: Answer) -> str:
        text = " ".join((answer.stdout + answer.stderr).split())
        missing = [word for word in words if not re.search(word, text)]
        if never and (found := re.search(never, text)):
            return f"says {found[0]!r}"
        return f"does not say {missing[0]!r}" if missing else ""

    return judge


def _obeyed(name: str, file: str, truth: str, script: str = OBEY) -> Case:
    return Case(name, {"problem.toml": file, "obey.py": script}, ("python", "obey.py"), _helps, truth)


def _told(name: str, file: str, judge: Callable[[Answer], str], truth: str, *options: str) -> Case:
    return Case(name, {"problem.toml": file}, ("solve", "problem.toml", *options), judge, truth)


def _cases() -> list[Case]:
    fastest = 'minimize = "abscissa"'
    found = [
        _obeyed(f"missing {name}", _file(_without(table, name), fastest), "an example is in the parameter's range")
        for table, names in ((_SKATES, ("z_H", "z_B", "lambda_s", "m_H")), (_COMPACT, ("zeta_H", "zeta_B")))
        for name in names
    ]
    inertia = "two point masses on skates have neither inertia nor wheels; the Whipple bicycle has"
    found += [
        _told(f"{name} in tms", _file({**_SKATES, name: 0.1}, fastest), _says("whipple", never="did you mean"), inertia)
        for name in ("I_Bxx", "I_Hzz", "r_F", "m_R")
    ]
    senses = (
        ("minimize", "decay_rate"),
        ("maximize", "decay_time"),
        ("maximize", "abscissa"),
        ("minimize", "damping_ratio"),
    )
    for sense, name in senses:
        other = "maximize" if sense == "minimize" else "minimize"
        judge = _says(rf'{other} = "{name}"')
        found.append(
            _told(f"{sense} {name}", _file(_SKATES, f'{sense} = "{name}"'), judge, "less of it is less stable")
        )
    judge = _says(never="asks for the least stable")
    found.append(
        _told("minimize v", _file({**_SKATES, "v": {"min": 3, "max": 5}}, 'minimize = "v"'), judge, "no sense")
    )

    masses = {**_SKATES, "m_B": {"min": 14, "max": 20}, "m_H": {"min": 1.5, "max": 3}}
    proved = _says("infeasible, proved", never="infeasibility is not proved")
    limits = {"total": "m_B + m_H <= 15"}
    found.append(_told("total of masses", _file(masses, fastest, limits), proved, "14 + 1.5 > 15"))
    limits = {"ahead": "x_B >= 0.6", "behind": "x_B <= 0.59"}
    found.append(_told("two limits on x_B", _file(_SKATES, fastest, limits), proved, "0.6 > 0.59"))
    limits = {"loads": "chi_B*chi_H >= 5.2"}
    found.append(_told("product", _file(_COMPACT, fastest, limits), proved, "chi_B chi_H <= 5"))

    oscillator, damper = _polynomial(1, "c", 1), {"c": {"min": 0.1, "max": 5}}
    why = "s² + c s + 1: no abscissa is below −1, where c = 2"
    found.append(_obeyed("decay of 2", _file(damper, fastest, {"decay": "abscissa <= -2"}, oscillator), why))
    why = "−c/2 <= −0.8 takes c >= 1.6"
    narrow = {"c": {"min": 0.1, "max": 1.5}}
    found.append(
        _obeyed("a damper too weak", _file(narrow, 'minimize = "c"', {"decay": "abscissa <= -0.8"}, oscillator), why)
    )
    unstable = {"c": {"min": -3.0, "max": -1.0}}
    why = "s² + c s + 1 is stable for c > 0 alone, so the end of c must move"
    found.append(
        _obeyed(
            "stable beyond the range", _file(unstable, 'minimize = "c"', {"decay": "abscissa <= -0.1"}, oscillator), why
        )
    )
    heavy = {**_COMPACT, "chi_B": {"min": 1.01, "max": 3}, "lambda_s": {"min": "10 deg", "max": "45 deg"}}
    limits = {"heavy": "damping_ratio >= 1", "slow": "Fr <= 0.5"}
    found.append(
        _obeyed("damped when slow", _file(heavy, 'minimize = "Fr"', limits), "below Fr_c none is stable (flus)")
    )
    limits = {"decay": "abscissa <= -1", "slow": "Fr <= 1"}
    found.append(_obeyed("fast when slow", _file(_COMPACT, fastest, limits), "a solve of the changed file"))

    for end in ("1.23567", "2.34567"):  # three digits and four round both up, beyond the limit
        limits = {"weak": f"c <= {end}"}
        file = _file({"c": {"min": 0.1, "max": 5}}, fastest, limits, _polynomial(1, "c", 9))
        judge = _says("rounding: 3 digits", never=r"[34] digits keep \d+ % of the decay(?! but violate)")
        found.append(_told(f"digits beyond {end}", file, judge, f"{float(end):.3g} and {float(end):.4g} exceed {end}"))

    quintic = {n: {"min": -2, "max": 2} for n in ("a", "b", "c", "d")}
    several = _file(quintic, fastest, None, _polynomial(1, "a + 1", "b + 2", "c + 1", "d + 1"))
    for name, file in (("four free", several), ("one free", _file(damper, fastest, None, oscillator))):
        found.append(_obeyed(f"more, {name}", file, "chart takes two or three free parameters, trace a pattern", MORE))
    file = _file(
        {**_COMPACT, "mu": {"min": 0.02, "max": 0.2}, "zeta_B": {"min": -1, "max": -0.3}},
        fastest,
        {"arm": "nu_H >= 0.02"},
    )
    judge = _says(r"--certify [2-9]\d* |\(proved|is proved", never=r"; --certify closes|a longer --certify")
    found.append(_told("after --certify", file, judge, "whoever gave --certify 1 must give it more", "--certify", "1"))
    return found


CASES = tuple(_cases())

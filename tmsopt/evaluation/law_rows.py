"""Compares a design with the closed-form laws of the paper, one row per law."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt import laws
from tmsopt.problem.solution import Solution
from tmsopt.records import plain
from tmsopt.roots import is_stable

_CLOSED_FORM = "a1a3, a2, w0"  # label of the equations that give several parameters

LAWS = (
    "w0",
    "4poly",
    "chib",
    "a2",
    "a1a3 a2 w0 Fr",
    "a1a3 a2 w0 mu",
    "a1a3 a2 w0 tan(lambda_s)",
    "lscf",
    "flus",
    "Frc1",
    "frm",
    "w01",
    "chib1",
    "tls",
    "frep4",
    "epset",
)
"""Names of all laws, in the order of `law_rows`."""

SAME_LAW = 1e-9
"""Largest relative difference between a number and a law that agree; coefficients agree to 1e-10."""


@dataclass(frozen=True)
class LawRow:
    """One law compared with a design.

    Attributes:
        label: equation label in the paper.
        subject: the quantity compared.
        numeric: value of the subject for the design, computed without the law.
        law: value of the subject by the law.
        reason: why the law does not apply to this design; empty if the law applies.
    """

    label: str
    subject: str
    numeric: float
    law: float
    reason: str

    @property
    def name(self) -> str:
        """The label without commas, followed by the subject if the equation gives several parameters."""
        return (
            f"{self.label} {self.subject.split(',')[0]}".replace(",", "") if self.label == _CLOSED_FORM else self.label
        )

    @property
    def applies(self) -> bool:
        """Whether the law's conditions hold for the design."""
        return not self.reason

    @property
    def residual(self) -> float:
        """Numeric minus law."""
        return self.numeric - self.law

    @property
    def relative(self) -> float:
        """Residual relative to the law, or to 1 if the law gives 0."""
        return self.residual / (abs(self.law) or 1.0)

    @property
    def agrees(self) -> bool | None:
        """Whether number and law agree; None if the law does not apply."""
        return abs(self.relative) <= SAME_LAW if self.applies else None

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        data = plain(self, "label subject numeric law residual relative applies agrees reason")
        return data if self.applies else data | {"residual": None, "relative": None}


def law_rows(design: Solution) -> Iterator[LawRow]:
    """Every law, with a reason if it does not apply to the design."""
    p = {name: float(value) for name, value in design.dimensionless.items()}
    heights, heights_and_tilt = _select_parameters(p), _select_parameters(p, "lambda_s")
    # Reasons why a law does not apply; an empty reason means that it applies.
    no_ep4 = "" if design.structure == "EP4" else f"holds at EP4; {_explain_missing_ep4(design)}"
    no_unit_chi_H = "" if p["chi_H"] == 1 else f"needs chi_H = 1; here chi_H = {p['chi_H']:.6g}"
    r, T = design.abscissa, math.tan(p["lambda_s"])
    a = np.array([design.quantities[f"a{k}"] for k in range(5)])

    def row(label: str, subject: str, numeric: Any, law: Any, reason: str) -> LawRow:
        return LawRow(label, subject, float(numeric), float(law), reason)

    root = "abscissa, the 4-fold root"
    yield row("w0", root, r, laws.w0(p["mu"], p["chi_H"], **heights_and_tilt), no_ep4)
    mismatch = np.max(np.abs(a / a[0] / laws.poly4(r) - 1)) if r and a[0] else math.nan
    yield row("4poly", "largest relative mismatch of a coefficient", mismatch, 0.0, no_ep4)
    yield row("chib", "chi_B", p["chi_B"], laws.chib(r, p["chi_H"], **heights), no_ep4)
    a2 = laws.a2(p["Fr"], p["mu"], p["chi_H"], **heights_and_tilt, omega0=r)
    yield row("a2", "left minus right side", a2, 0.0, no_ep4)

    has_free_mass_ratio = "" if no_unit_chi_H else "at chi_H = 1 the mass ratio is free; see the laws for chi_H = 1"
    branches = laws.ep4(r, **heights, chi_H=p["chi_H"])
    # the branch of the law that is nearest to the design
    branch = min(branches, key=lambda b: abs(float(b.tan_lambda_s) - T) + abs(float(b.Fr) - p["Fr"]))
    closed_forms = (("Fr", p["Fr"], branch.Fr), ("mu", p["mu"], branch.mu), ("tan(lambda_s)", T, branch.tan_lambda_s))
    for subject, numeric, law in closed_forms:
        yield row(_CLOSED_FORM, f"{subject}, closed form for any chi_H", numeric, law, no_ep4 or has_free_mass_ratio)

    critical = design.quantities["Fr_c"]
    no_weave = "" if math.isfinite(critical) else "the design has no weave boundary"
    incomplete = "incomplete for chi_H < 1: a1 > 0 is missing" if p["chi_H"] < 1 else ""
    not_optimal = f"holds at chi_B = {float(laws.chibm(**heights)):.6g}"
    laws_by_label = speed_laws(p, critical, a)
    for label, subject, reason in (
        ("lscf", "stable (1) or not (0)", incomplete if p["lambda_s"] > 0 else "stated for lambda_s > 0"),
        ("flus", "Fr_c", no_weave),
        ("Frc1", "Fr_c", no_unit_chi_H or no_weave),
        ("frm", "Fr_c, least over chi_B", no_unit_chi_H or no_weave or not_optimal),
    ):
        numeric, law, applies = laws_by_label[label]
        yield row(label, subject, numeric, law, "" if applies else reason)

    no_special_ep4 = no_unit_chi_H or no_ep4
    yield row("w01", root, r, laws.w01(**heights), no_special_ep4)
    yield row("chib1", "chi_B", p["chi_B"], laws.chib1(**heights), no_special_ep4)
    yield row("tls", "tan(lambda_s)", T, laws.tls(**heights), no_special_ep4)
    yield row("frep4", "Fr", p["Fr"], laws.frep4(**heights)[0], no_special_ep4)
    is_on_ep_set = design.structure in ("EP4", "2EP2", "CEP2")
    no_ep_set = "" if is_on_ep_set else f"holds on the EP set; the structure is '{design.structure}'"
    yield row("epset", "Fr", p["Fr"], laws.epset(**heights_and_tilt), no_unit_chi_H or no_ep_set)


def speed_laws(p: Mapping[str, Any], critical: Any, coefficients: Any) -> dict[str, tuple[Any, Any, Any]]:
    """Laws of stability and of the critical Froude number.

    Args:
        p: dimensionless parameters, numbers or arrays.
        critical: the critical Froude number of the design.
        coefficients: shape (…, 5).

    Returns:
        Label → the number for the design, the number by the law, and whether the law applies.
    """
    heights, heights_and_tilt, shape = (
        _select_parameters(p, *names) for names in ((), ("lambda_s",), ("lambda_s", "mu", "chi_B", "chi_H"))
    )
    exists, has_unit_height = np.isfinite(critical), p["chi_H"] == 1
    optimum = laws.chibm(**heights)
    is_optimal = np.abs(p["chi_B"] - optimum) <= SAME_LAW * np.maximum(np.abs(p["chi_B"]), np.abs(optimum))
    is_stable_by_law = np.all(laws.lscf(p["Fr"], **shape), axis=0)
    frc1 = np.sqrt(np.maximum(laws.Frc1(p["chi_B"], **heights_and_tilt), 0.0))
    return {
        "lscf": (1.0 * is_stable(coefficients), 1.0 * is_stable_by_law, (p["lambda_s"] > 0) & (p["chi_H"] >= 1)),
        "flus": (critical, laws.Fr_c(**shape), exists),
        "Frc1": (critical, frc1, has_unit_height & exists),
        "frm": (critical, laws.frm(**heights_and_tilt), has_unit_height & exists & is_optimal),
    }


def _select_parameters(p: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """The parameters zeta_B and zeta_H, and further parameters by name."""
    return {n: p[n] for n in ("zeta_B", "zeta_H", *names)}


def _explain_missing_ep4(design: Solution) -> str:
    """The part of a reason that says which structure the design has instead, and why."""
    limits = ", ".join(design.active)
    reason = f" because {limits} bind{'s' if len(design.active) == 1 else ''}" if limits else ""
    if not design.problem.free:
        reason = " and nothing is free"
    return f"the structure is '{design.structure}'{reason}"

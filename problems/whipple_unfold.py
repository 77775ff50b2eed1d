"""How does the EP4 of the two-mass-skate bicycle separate if the bicycle gets wheels and trail? How can you restore it?

A mass at a wheel contact has no effect on the lateral motion, so wheels can grow from points. Their radius is 0.3 m
times eps, and each is a hoop of 1 kg. The trail is 50 mm times eps. At eps = 0 this is the bicycle of ep4.toml for a
frame of 10 kg. A 4-fold root r moves to s = r + (kappa^4 eps)^(1/4), with kappa^4 = -p'(r)/a0, where p' is the
derivative by eps. If kappa^4 > 0, as for trail, the roots move along the axes, and one of them to the right. If
kappa^4 < 0, as for wheels, they move along the diagonals. With a trail of 1.65 wheel radii, p(r) does not change to
first order, and three roots move as eps^(1/3). If speed, frame and tilt are tuned again, the EP4 exists at every eps
up to wheels with a radius of 90 mm. With a radius of 30 mm or more the bicycle stands on both wheels.

To draw the figure, give its name: python problems/whipple_unfold.py whipple_unfold.png
"""

import sys
from pathlib import Path

import flint
import numpy as np

import tmsopt
from tmsopt.algebra.balls import rational
from tmsopt.models import whipple
from tmsopt.roots import exact_roots, shift

RADIUS, TRAIL, MASS = flint.fmpq(3, 10), flint.fmpq(1, 20), flint.fmpq(1)
KINDS = {"wheels": (1, 0), "trail": (0, 1), "both": (1, 1)}
flint.ctx.dps = 100

# The EP4 in closed form, in SI for w = 1 m and m_B = 10 kg
g, half = flint.fmpq(981, 100), flint.arb(2).sqrt()
tangent = flint.arb(15) / 4 - 75 * half / 32
skates = {p.name: flint.fmpq(0) for p in whipple.sets[0].parameters} | {
    "w": flint.fmpq(1), "g": g, "m_B": flint.fmpq(10), "z_B": flint.fmpq(-2, 5), "m_H": flint.fmpq(1),
    "x_H": flint.fmpq(1), "z_H": flint.fmpq(-1, 5), "x_B": half, "lambda_s": tangent.atan(),
    "v": 3 * (110 * half - 120).sqrt() / 8 * flint.arb(g).sqrt(),
}  # fmt: skip
root = -(flint.arb(flint.fmpq(25, 2)).sqrt() * g).sqrt()


def grown(eps, wheels, trail):
    """Wheels and trail of a size eps, in shares of the full ones."""
    r = RADIUS * wheels * eps
    each = {"r_{}": r, "m_{}": MASS, "I_{}xx": MASS * r * r / 2, "I_{}yy": MASS * r * r}
    named = {name.format(end): x for end in "RF" for name, x in each.items()}
    return {**named, "c": TRAIL * trail * eps}


def coefficients(eps, wheels, trail):
    return whipple.coefficients({**skates, **grown(eps, wheels, trail)})


def first_order(wheels, trail):
    """Derivatives by eps of p(r)/a0 and p'(r)/a0, by a step that 100 digits bear."""
    step = flint.fmpq(1, 10**40)
    a = shift(coefficients(step, wheels, trail), root)
    return [float((c / a[0] / step).mid()) for c in (a[-1], a[-2])]


def displacements(eps, wheels, trail):
    """s − r of the four roots."""
    exactly = exact_roots([rational(c) for c in coefficients(eps, wheels, trail)])
    return np.array([complex(z.re, z.im) for z in exactly]) - float(root.mid())


def tuned(eps, near):
    """The EP4 at a size, by speed, frame and tilt, from that of a smaller size."""
    sizes = {n: float(x) for n, x in grown(flint.fmpq(round(1000 * eps), 1000), 1, 1).items()}
    fixed = {n: float(skates[n]) for n in ("w", "m_B", "z_B", "m_H", "x_H", "z_H")}
    free = {"v": (0.5, 20.0), "x_B": (-1.0, 6.0), "lambda_s": (-1.4, 1.4)}
    problem = tmsopt.Problem(whipple, fixed={**fixed, **sizes}, free=free, locate="EP4", start=near)
    return tmsopt.solve(problem, starts=4)


def held_trail():
    """Share of the full trail, per share of the full wheels, that keeps p(r) to first order."""
    return -first_order(1, 0)[0] / first_order(0, 1)[0]


def draw(path):
    from tmsopt.plots.style import new_figure, save

    figure = new_figure(10.5, 4.0)
    left, right = figure.subplots(1, 2)
    sizes = np.logspace(-8, -1, 57)
    exact = [flint.fmpq(round(1e12 * e), 10**12) for e in sizes]
    cases = {**KINDS, "both, trail 1.65 radii": (1, rational(flint.arb(held_trail())))}
    for name, shares in cases.items():
        far = [np.abs(displacements(e, *shares)).max() for e in exact]
        (line,) = left.loglog(sizes, far, label=name)
        last, next_to_last = first_order(*shares)
        law = (abs(last) * sizes) ** 0.25 if abs(last) > 1 else (abs(next_to_last) * sizes) ** (1 / 3)
        left.loglog(sizes, law, color=line.get_color(), linestyle=":", linewidth=1)
    left.set_xlabel(r"size $\varepsilon$ of wheels and trail")
    left.set_ylabel(r"greatest $|s - r|$ in 1/s")
    left.legend(fontsize=8, title=r"dotted: $\varepsilon^{1/4}$ and $\varepsilon^{1/3}$ laws", title_fontsize=8)
    for name in ("wheels", "trail"):
        places = np.array([displacements(e, *KINDS[name]) for e in exact[:41]]) + float(root.mid())
        right.plot(places.real.ravel(), places.imag.ravel(), ".", markersize=3, label=name)
    right.plot([float(root.mid())], [0], "k*", markersize=9)
    right.annotate("EP4", (float(root.mid()), 0), xytext=(-36, -14), textcoords="offset points")
    right.set_xlabel(r"$\mathrm{Re}\,s$ in 1/s")
    right.set_ylabel(r"$\mathrm{Im}\,s$ in 1/s")
    right.set_title(r"roots up to $\varepsilon = 10^{-3}$", fontsize=9.5)
    right.legend(fontsize=8)
    right.set_aspect("equal", adjustable="datalim")
    save(figure, Path(path))


if __name__ == "__main__":
    print("grown           kappa^4    eps      right of r     by the law")
    for name, shares in KINDS.items():
        kappa4 = -first_order(*shares)[0]
        part = 1.0 if kappa4 > 0 else 0.5**0.5  # cosine of the direction nearest to the right
        for exponent in (12, 8, 4):
            moved = displacements(flint.fmpq(1, 10**exponent), *shares).real.max()
            law = abs(kappa4) ** 0.25 * 10 ** (-exponent / 4) * part
            print(f"{name:8} {kappa4:14.6f}    1e-{exponent:<2}  {moved:12.8f}   {law:12.8f}")
    print(f"trail that keeps one root to first order: {held_trail() * float(TRAIL / RADIUS):.8f} wheel radii")
    print("\nsize    radius mm  trail mm  abscissa 1/s      v m/s    x_B m     tilt deg   rear load %")
    near = {n: float(skates[n]) for n in ("v", "x_B", "lambda_s")}
    for eps in (0.0, 0.01, 0.05, 0.1, 0.2, 0.3):
        design = tuned(eps, near)
        near = {n: design.parameters[n] for n in near}
        p, load = design.parameters, 100 * design.quantities["load_rear"]
        print(
            f"{eps:<6}  {1e3 * p['r_F']:9.1f}  {1e3 * p['c']:8.2f}  {design.abscissa:12.8f}  {p['v']:9.5f}"
            f"  {p['x_B']:8.5f}  {np.degrees(p['lambda_s']):9.4f}  {load:11.3f}"
        )
    if len(sys.argv) > 1:
        draw(sys.argv[1])

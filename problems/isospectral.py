"""Which bicycles have the same four roots, all at s = -1? A study of one family of bicycles with the same roots.

The paper's optimised benchmark is one of these bicycles. Each row has other heights of the two masses. It solves for
the bicycle whose four roots coincide at -1, and compares its mass ratio with the closed form `tmsopt.laws.ep4`.
"""

from dataclasses import replace
from math import degrees

import tmsopt
from tmsopt import laws

problem = tmsopt.load("problems/optimised_benchmark.toml")

print("zeta_B  zeta_H  chi_B     mu (solved)       mu (law)          tilt/deg  Fr        ballast  abscissa")
for zeta_B, zeta_H in [(-0.4, -0.2), (-0.4, -0.3), (-0.6, -0.3), (-0.8, -0.4), (-1.0, -0.5), (-1.158, -0.526)]:
    # The same problem for another bicycle: four conditions for four free parameters.
    heights = {"zeta_B": zeta_B, "zeta_H": zeta_H}
    design = tmsopt.solve(replace(problem, fixed={**problem.fixed, **heights}))

    law, _ = laws.ep4(-1.0, zeta_B, zeta_H, problem.fixed["chi_H"])
    found = design.parameters
    print(
        f"{zeta_B:6.3f}  {zeta_H:6.3f}  {found['chi_B']:8.6f}  {found['mu']:16.12f}  {float(law.mu):16.12f}"
        f"  {degrees(found['lambda_s']):8.4f}  {found['Fr']:8.6f}  {design.quantities['ballast_rear']:7.4f}"
        f"  {design.abscissa:8.5f}"
    )

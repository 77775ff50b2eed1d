"""How do the heights of the two masses determine the best decay? A study in twenty lines.

For chi_H = 1 the smallest abscissa is the EP4 at omega0 = -(zeta_B zeta_H)^(-1/4), so low masses decay fast. Each row
solves the design problem numerically, says whether the optimum is proved, and compares it with this law.
"""

from dataclasses import replace

import tmsopt
from tmsopt import laws

problem = tmsopt.load("problems/ep4.toml")

print("zeta_B  zeta_H   abscissa (solved)   abscissa (law)      tilt/deg   Fr      proven")
for zeta_B, zeta_H in [(-0.4, -0.2), (-0.5, -0.2), (-0.6, -0.3), (-0.8, -0.4), (-1.0, -0.5), (-1.158, -0.526)]:
    # A problem is frozen data: `replace` returns a new problem and does not change the old one.
    heights = {"zeta_B": zeta_B, "zeta_H": zeta_H}
    design = tmsopt.solve(replace(problem, fixed={**problem.fixed, **heights}))

    law = float(laws.w01(**heights))
    tilt = design.parameters["lambda_s"] * 180 / 3.141592653589793
    print(
        f"{zeta_B:6.3f}  {zeta_H:6.3f}  {design.abscissa:18.14f}  {law:18.14f}"
        f"  {tilt:8.3f}  {design.parameters['Fr']:6.4f}  {design.bound.proven}"
    )

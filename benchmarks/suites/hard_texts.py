"""Expressions that hard problems are made of; {a}, {b} and {c} stand for free parameters, from about −1 to 1."""

TRIG = (
    "sin(3*{a}) + cos(2*{b})", "sin(4*{a} + 3*{b})", "tan({a}) - {b}", "{a}*cos(5*{b})", "sin(6*{a})*{b}",
    "cos({a})/(1.5 + sin(4*{b}))", "atan(5*{a}) - sin(3*{b})", "sin(3*{a})*sin(4*{b}) + {c}/2",
)  # fmt: skip
RATIOS = (
    "({a} + 2)/({b} + 3)", "{a}/(1 + {b}**2)", "({a}**2 + 1)/({b}**2 + 0.2)", "{a}/({b} + 1.2)",
    "(1 + {a}*{b})/(2 + {c})",
)  # fmt: skip
CURVED = (
    "{a}**2 + {b}**2", "{a}*{b}", "{a}**3 - {b}", "exp({a}) - {b}**2", "sqrt(1.5 + {a})*{b}", "{a}*{b} + {c}",
    "({a} + {b})**2 - {c}", "{a}", "{a} + {b}", "{a} - 2*{b} + {c}",
)  # fmt: skip
KINKED = (
    "abs({a}) + abs({b})", "max({a}, {b})", "min({a}, {b})", "abs({a} - {b}**2)",
    "max({a}, 0.5 - {b}) - min({a}*{b}, 0.1)", "abs(abs({a}) - 0.5) + {b}", "max(min({a}, {b}), -{c})",
)  # fmt: skip
POLES = (
    "1/({a} - {b})", "tan(9*{a})", "1/sin(4*{a})", "1/({a}**2 + {b}**2 + 0.001)", "tan(5*{a} + 2*{b})",
    "{b}/({a} - 0.1)", "1/({a} + {b} - 0.3*{c})", "log(1/abs({a} - 0.3*{b}))",
)  # fmt: skip
ROOT_KINKS = (
    "abs(abscissa + {n})", "max(abscissa, -{n})", "abs(abscissa + 0.2) + 0.1*damping_ratio",
    "abscissa*damping_ratio", "abscissa - 0.3*damping_ratio", "max(abscissa, -damping_ratio)",
    "abs(damping_ratio - 0.3) + 0.5*abs(abscissa + {n})", "max(abscissa + {n}, 0.5*{a})",
    "damping_ratio**2 + abscissa", "abs(abscissa - damping_ratio)", "min(abscissa, -{n}) + {a}**2/2",
    "max(abscissa, abs({a}) - 1)", "min(damping_ratio, 0.4) - 0.3*{a}", "abs(abscissa + {n}) + abs({a})/3",
    "-min(damping_ratio, -abscissa)", "max(abs(abscissa), {b}**2)",
)  # fmt: skip
NATIVE = (
    "Fr_c", "omega0", "nu_H", "chi_T", "load_front", "mass_margin", "ballast_rear", "Fr", "mu", "lambda_s", "chi_B",
    "Fr - 1.1*Fr_c", "nu_H*Fr", "omega0 + 0.2*Fr", "mu*nu_H", "Fr_c/(1 + mu)", "abs(nu_H) - 0.1*Fr", "a1/a0", "a3/a1",
)  # fmt: skip
SI = ("v", "v_c", "m_H", "N_F", "N_R", "u_H", "x_B", "lambda_s**2", "v - v_c", "v/v_c", "m_ballast_rear", "omega0")
WHIPPLE = (
    "v", "v_weave", "v_capsize", "m_H", "N_F", "u_H", "mechanical_trail", "v_capsize - v_weave", "x_B", "u_A", "omega0",
    "lambda_s**2",
)  # fmt: skip
EQUAL = (
    "{a} - {b}", "{a}*{b}", "{a}**2 + {b}**2", "sin(3*{a}) - {b}", "{a}**3 - {b}*{c}", "exp({a}) + {b}",
    "tan({a}) - {b}", "{a}/({b} + 2)", "abs({a}) + {b}",
)  # fmt: skip

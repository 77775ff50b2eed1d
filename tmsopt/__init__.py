"""tmsopt: self-stable bicycles under your own constraints, and exceptional points of small dissipative systems.

There are eight main functions. Each takes a `Problem`, the path of its file, or a design found before:

    solve       finds the best design                  design = tmsopt.solve("robot.toml"); print(design)
    prove       proves that it exists, with 30 digits  tmsopt.prove(design).proved
    compare     compares it with the closed-form laws  print(tmsopt.compare(design))
    speeds      finds the speeds of weave and capsize  tmsopt.speeds(design).stable
    robustness  measures its distance from instability tmsopt.robustness(design).radius
    trace       traces curves of exceptional points    tmsopt.trace("ep_set.toml", "EP2").plot()
    chart       maps stability over two parameters     tmsopt.chart("chart.toml").plot()
    run_study   solves thousands of problems           tmsopt.run_study("study.toml").to_frame()

Every result has `print`, `.report(full=True)`, `.plot()`, `.to_json()`; tables have `.to_frame()`. `Problem` states a
problem in Python, `load` reads one, `models` has the bicycles and `models.from_matrices` makes any other system.

The file `__init__.pyi` lists the public names. A name is imported when it is first used, so that `tmsopt --help` does
not wait for CasADi.
"""

__version__ = "1.1.0"


def __getattr__(name: str) -> object:
    """Find a public name. The modules that do this are imported here, so that a command handles signals before."""
    from importlib import import_module

    import lazy_loader

    from tmsopt.deprecated import ReportModule

    read, names, listed = lazy_loader.attach_stub(__name__, __file__)

    def find(name: str) -> object:
        return ReportModule() if name == "report" else read(name)

    globals().update({"__getattr__": find, "__dir__": names, "__all__": listed})
    return getattr(import_module(__name__), name)


def __dir__() -> list[str]:
    return list(__getattr__("__all__"))

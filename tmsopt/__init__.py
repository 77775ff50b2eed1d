"""tmsopt: self-stable bicycles under your own constraints, and exceptional points of small dissipative systems.

Eight verbs; each takes a `Problem`, the path of its file, or a design found before:

    solve       the best design                   design = tmsopt.solve("robot.toml"); print(design)
    prove       that it exists, to 30 digits      tmsopt.prove(design).proved
    compare     it beside the closed-form laws    print(tmsopt.compare(design))
    speeds      where it weaves and capsizes      tmsopt.speeds(design).stable
    robustness  how far it is from both           tmsopt.robustness(design).radius
    trace       exceptional points as curves      tmsopt.trace("ep_set.toml", "EP2").plot()
    chart       stability over two parameters     tmsopt.chart("chart.toml").plot()
    run_study   thousands of such problems        tmsopt.run_study("study.toml").to_frame()

Every result has `print`, `.report(full=True)`, `.plot()`, `.to_json()`; tables have `.to_frame()`. `Problem` states a
problem in Python, `load` reads one, `models` has the bicycles and `models.from_matrices` makes any other system.

The public names stand in `__init__.pyi`, once; each is imported when it is first used, so that `tmsopt --help` need not
wait for CasADi.
"""

__version__ = "1.1.0"


def __getattr__(name: str) -> object:
    """A public name; what imports it is loaded first, so that a command hears signals before that."""
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

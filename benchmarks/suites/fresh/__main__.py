"""Compute what is known of the problems: ``python -m benchmarks.suites.fresh CACHE.json [COUNT]``, again to resume."""

import sys
import time
from pathlib import Path

from benchmarks.suites.fresh import COUNT, Cache, known, problems


def main(path: str, count: str = str(COUNT)) -> None:
    """Of all problems, those with the least number in their family first."""
    cache = Cache(Path(path))
    for problem in sorted(problems(int(count)), key=lambda p: p.name.split("/")[1]):
        if problem.name not in cache:
            began = time.process_time()
            cache.keep(problem.name, known(problem))
            print(
                f"{problem.name} {time.process_time() - began:.1f} s {cache[problem.name]}", file=sys.stderr, flush=True
            )


if __name__ == "__main__":
    main(*sys.argv[1:])

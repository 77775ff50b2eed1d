"""All benchmarks that compare: ``python -m benchmarks``."""

import sys

from benchmarks.sections import main

if __name__ == "__main__":
    sys.exit(main())

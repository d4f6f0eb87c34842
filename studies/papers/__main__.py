"""Run the study; the same as ``isolation-sim study papers``."""

import sys

from isolation_sim.cli import main

if __name__ == "__main__":
    main(["study", "papers", *sys.argv[1:]])

"""Studies that can be run: benchmarks, papers reproduced, controllers compared."""

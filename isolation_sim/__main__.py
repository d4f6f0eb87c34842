"""``python -m isolation_sim``: the same as the command ``isolation-sim``."""

from .cli import main

if __name__ == "__main__":
    main()

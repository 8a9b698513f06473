"""``python -m sim.bench``."""

from sim.bench.ratios import main

if __name__ == "__main__":
    main()

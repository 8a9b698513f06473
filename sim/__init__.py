"""Six-degree-of-freedom submarine simulator driven by a tabulated coefficient database."""

from sim.compiled_cache import use_keyed_cache

use_keyed_cache()

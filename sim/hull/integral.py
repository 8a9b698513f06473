"""The trapezoidal rule under the name that NumPy 2 gave it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

# NumPy 1 has it as trapz.
trapezoid: Callable[..., Any] = getattr(np, "trapezoid", None) or getattr(np, "trapz", None)  # type: ignore[assignment]

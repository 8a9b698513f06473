"""What happens when another library comes in: the environments are known to Gymnasium as soon as both are imported."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType


class _WithGymnasium:
    """A finder on ``sys.meta_path`` that waits for Gymnasium and lets all others pass."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Gymnasium's own spec, whose loading ends with the registration."""
        if name != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is None or spec.loader is None:
            return None
        load = spec.loader.exec_module

        def load_and_register(module: ModuleType) -> None:
            load(module)
            import_module("ident.environments")

        spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec


def register_with_gymnasium() -> None:
    """Register the environments: now where Gymnasium is in use, else when it is imported."""
    if "gymnasium" in sys.modules:
        import_module("ident.environments")
    else:
        sys.meta_path.insert(0, _WithGymnasium())

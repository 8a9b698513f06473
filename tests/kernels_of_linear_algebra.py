"""Kernels of OpenBLAS that this machine executes, for tests of what must be the same under each."""

from __future__ import annotations

import platform
from pathlib import Path

# Core types and what a processor needs to execute them.
CORE_TYPES = {
    "Nehalem": {"sse4_2"},
    "Sandybridge": {"avx"},
    "Haswell": {"avx2", "fma"},
    "Zen": {"avx2", "fma"},
    "SkylakeX": {"avx512f", "avx512dq", "avx512bw", "avx512vl"},
}


def kernels() -> list[dict[str, str]]:
    """Environments with a core type each: the oldest and the two newest; of libraries without, one that sets none."""
    known: list[str] = []
    if platform.machine() in ("x86_64", "AMD64") and Path("/proc/cpuinfo").is_file():
        text = Path("/proc/cpuinfo").read_text()
        flags = set(next(line for line in text.splitlines() if line.startswith("flags")).split())
        known = [name for name, needs in CORE_TYPES.items() if needs <= flags]
        assert len(known) >= 3, "a processor of the last ten years"
        known = [known[0], *known[-2:]]
    return [{"OPENBLAS_CORETYPE": name} for name in known] or [{}]


def threads(count: int) -> dict[str, str]:
    """Environment in which linear algebra has so many threads."""
    return {f"{k}_NUM_THREADS": str(count) for k in ("OPENBLAS", "OMP", "MKL")}

"""Gymnasium environments: depth, course, zigzag and path of a boat of a database version.

Importing this registers them; it needs the extra ``gym``.

>>> import gymnasium, ident.environments  # doctest: +SKIP
>>> env = gymnasium.make("ident/DepthKeeping-v0", case="ss5-4m", db="coeff_db")  # doctest: +SKIP
"""

from __future__ import annotations

TASKS = ("DepthKeeping", "CourseKeeping", "Zigzag", "PathFollowing")


def register() -> None:
    """Make the environments known to Gymnasium; once is enough."""
    import gymnasium

    for task in TASKS:
        name = f"ident/{task}-v0"
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="ident.environments.boat:BoatEnv",
                vector_entry_point="ident.environments.fleet:FleetEnv",
                kwargs={"task": task},
            )


register()

"""One made campaign in the formats of laboratories and solvers."""

from __future__ import annotations

from made_campaigns import (
    BETA,
    SAMPLES,
    VALUES,
)


def body(form, delimiter: str = ",") -> str:
    return "".join(
        delimiter.join(form(v) for v in (b, *row)) + "\n"
        for b, row in zip(BETA, (VALUES / [1e3, 1.0, 1e3]).tolist(), strict=True)
    )


PLAIN = "beta_deg,Fx [kN],Y [N],Mz (kN m)\n" + body(repr)
MAP = 'Fx = "X"\n"Mz (kN m)" = "N"'
STAR = (
    '"Iteration","Physical Time: Physical Time (s)","Drag Monitor: Drag Monitor (N)",'
    '"Side force Monitor: Force (kN)","Yaw Monitor: Moment (N-m)","Continuity Monitor: Residual"\n'
    + "".join(
        f"{i},{t!r},{x!r},{y / 1e3!r},{n!r},1e-5\n"
        for i, (t, x, y, n) in enumerate(SAMPLES)
    )
)  # fmt: skip
PATTERNS = r"""[source.patterns]
'^Physical Time:' = "time"
'^Drag Monitor: .*\((N)\)' = "X"
'^Side force Monitor:' = "Y"
'^Yaw Monitor: ' = "N [N m]"
"""
ROWS = "".join(f"  {t:8.4f}   {x:14.8e}  {y:14.8e}\t{n:14.8e}\n" for t, x, y, n in SAMPLES)

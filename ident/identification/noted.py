"""What a fit has to say beside its values: loads that it left out, and warnings."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

# Said of a value that the runs do not determine by itself.
UNTOLD = "the runs cannot tell it from other terms; dropped"


@dataclass(frozen=True)
class UnusedLoad:
    """A load of a run that identifies nothing, and why.

    Attributes
    ----------
    run_id : The run.
    file : It was read from, relative to the campaign.
    row : Of the file, counted from 1 with its header.
    output : Name of the load, as the term table has it (``X`` to ``N``, ``KT``, ``KQ``, ``n``).
    reason : In words.

    Examples
    --------
    >>> import ident
    >>> (done,) = ident.fit("my-boat/captive", db="coeff_db")
    >>> one = done.identification.unused[0]
    >>> one.reason != "" and one.file.endswith(".csv")
    True
    """

    run_id: str
    file: str
    row: int
    output: str
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The load for a program to read."""
        return asdict(self)


@dataclass(frozen=True)
class FitWarning:
    """What is to be said of a run or coefficient that was used.

    Attributes
    ----------
    subject : Name of the run or symbol of the coefficient.
    message : In words, with the number it is about.

    Examples
    --------
    >>> import ident
    >>> (done,) = ident.fit("my-boat/captive", db="coeff_db")
    >>> [one.message for one in done.identification.warnings if one.subject == "N_v"]
    []
    """

    subject: str
    message: str

    def to_dict(self) -> dict[str, str]:
        """The warning for a program to read."""
        return asdict(self)

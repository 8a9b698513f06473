"""Names, messages and paths as text: on a terminal, in a figure, in the name of a file.

What a file or a user says is text, never markup: every word of it goes through one of these before
it is shown. Pages of HTML escape by themselves (``ident.report.page``).
"""

from __future__ import annotations

import re
import unicodedata

# Cc: control characters, escape sequences begin with one. Cf: those that turn the direction of writing.
# Cs: bytes that are no text. Zl, Zp: line ends that no terminal shows as such.
_UNSEEN = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))


# A bracket, and what follows where rich would read markup.
_BRACKET = re.compile(r"(\\*)\[([a-z#/@][^\[]*?\])?")


# What Windows takes for a device, whatever comes after a point.
_DEVICE = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d|com[¹²³]|lpt[¹²³]|conin\$|conout\$) *(?:\..*)?", re.IGNORECASE)


def visible(text: str, keep: str = "") -> str:
    r"""Text with every character that would act instead of being shown written out.

    Parameters
    ----------
    text : Any.
    keep : Characters that stay, such as line ends.

    Examples
    --------
    >>> visible("drift\x1b[31m")
    'drift\\x1b[31m'
    """
    if text.isascii() and text.isprintable():
        return text
    shown = (c if c in keep or unicodedata.category(c) not in _UNSEEN else ascii(c)[1:-1] for c in text)
    return "".join(shown)


def on_screen(text: object) -> str:
    r"""Text for a rich console or table: brackets are brackets, not markup.

    Examples
    --------
    >>> on_screen("[red]")
    '\\[red]'
    """
    shown = _BRACKET.sub(_escaped, visible(str(text)))
    # Backslashes at the end would take the markup that follows for text.
    return shown + "\\" * (len(shown) - len(shown.rstrip("\\")))


def _escaped(match: re.Match[str]) -> str:
    """A bracket after backslashes, which rich counts where it takes the bracket for markup."""
    before = match[1]
    return (before * 2 if match[2] else before) + "\\[" + (match[2] or "")


def in_figure(text: object) -> str:
    r"""Text for matplotlib: dollar signs are dollar signs, not mathematics.

    Examples
    --------
    >>> in_figure("$5")
    '\\$5'
    """
    return visible(str(text)).replace("$", r"\$")


def in_file_name(text: object) -> str:
    """Text as a part of a file's name, which then stays in the folder it is put into.

    Separators, drive letters, control characters and what Windows refuses, a name of a device or dots and blanks
    at the end, become an underscore.

    Examples
    --------
    >>> in_file_name("../other/hzz20")
    '__other_hzz20'
    """
    kept = "".join("_" if c in '/\\:*?"<>|' or unicodedata.category(c) in _UNSEEN else c for c in str(text))
    if kept.startswith("."):
        # A hidden file, the folder itself or the one above.
        kept = "_" + kept.lstrip(".")
    if _DEVICE.fullmatch(kept):
        kept = "_" + kept
    if kept.endswith((".", " ")):
        kept = kept.rstrip(". ") + "_"
    # File systems take 255 bytes; suffix and version number are still to come.
    return kept.encode("utf-8")[:180].decode("utf-8", "ignore") or "_"

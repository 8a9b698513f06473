"""The console: whatever reaches it is shown, and nothing acts."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.errors import MarkupError
from rich.text import Text

from ident.text import visible


class Screen(Console):
    """A rich console that no text can crash or steer.

    Names are escaped where they are put into a line (``ident.text.on_screen``); what came through all the
    same is shown as it is.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Text with markup as rich reads it, control characters written out."""
        shown = visible(text, keep="\n\t")
        try:
            return super().render_str(shown, **options)
        except MarkupError:
            return super().render_str(shown, **{**options, "markup": False})

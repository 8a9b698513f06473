"""Nested tables as TOML text, for files that tests change key by key."""

from __future__ import annotations

import json
from typing import Any


def toml(data: dict[str, Any]) -> str:
    """Nested tables as inline TOML."""

    def text(value: Any) -> str:
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, dict):
            return "{ " + ", ".join(f"{json.dumps(k)} = {text(v)}" for k, v in value.items()) + " }"
        if isinstance(value, list):
            return "[" + ", ".join(map(text, value)) + "]"
        return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)

    return "".join(f"{k} = {text(v)}\n" for k, v in data.items())

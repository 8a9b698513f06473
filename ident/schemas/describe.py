"""Keys of vehicle, campaign, case, calibration and trial files: ``ident schema`` and the page of the documentation."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from ident.calibration.file import CalibrationFile
from ident.captive.campaign_file import CampaignFile
from ident.trials.spec import TrialFile
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.flight.case import Case

KINDS: dict[str, type[BaseModel]] = {
    "vehicle": Vehicle,
    "campaign": CampaignFile,
    "case": Case,
    "calibration": CalibrationFile,
    "trial": TrialFile,
}
_DIALECT = "https://json-schema.org/draft/2020-12/schema"


@dataclass(frozen=True)
class Key:
    """One key of a file.

    Attributes
    ----------
    table : TOML table it stands in, such as ``[scale]`` or ``[[source]]``; empty at the top.
    name : Of the key.
    kind : What it takes.
    default : Its value when left out; None when it is required.
    meaning : In words.
    """

    table: str
    name: str
    kind: str
    default: str | None
    meaning: str


def meanings(model: type[BaseModel]) -> dict[str, str]:
    """Key -> meaning, from the section Attributes of a model's docstring and those it extends."""
    meaning: dict[str, str] = {}
    for one in reversed(model.__mro__):
        section = re.search(r"Attributes\n\s*-+\n(.*)\Z", one.__doc__ or "", re.DOTALL)
        if not (section and issubclass(one, BaseModel)):
            continue
        for names, text in re.findall(r"^ {4}(\w[\w, ]*) : (.*(?:\n {8}.*)*)", section[1], re.MULTILINE):
            meaning |= {name.strip(): " ".join(text.split()) for name in names.split(",")}
    return meaning


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """The models inside an annotation such as ``list[Model] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for part in get_args(annotation) for m in models_in(part)]


def _every_model(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    models = {model.__name__: model}
    for field in model.model_fields.values():
        for inner in models_in(field.annotation):
            models |= _every_model(inner)
    return models


def schema(kind: str) -> dict[str, Any]:
    """The JSON schema of a kind of file, for editors and other programs.

    Parameters
    ----------
    kind : ``vehicle``, ``campaign``, ``case``, ``calibration`` or ``trial``.

    Returns
    -------
    dict
        JSON schema, draft 2020-12; every key has its meaning as ``description``.

    Raises
    ------
    InputError
        For another kind.

    Examples
    --------
    >>> import ident
    >>> schema = ident.schema("campaign")
    >>> schema["properties"]["name"]["description"]
    'Of the campaign.'
    """
    if kind not in KINDS:
        raise InputError("schema", repr(kind), ", ".join(KINDS))
    whole = KINDS[kind].model_json_schema()
    for name, model in _every_model(KINDS[kind]).items():
        part = whole if model is KINDS[kind] else whole["$defs"][name]
        part["description"] = " ".join((model.__doc__ or "").split("\n\n")[0].split())
        for key, text in meanings(model).items():
            if key in part["properties"]:
                part["properties"][key]["description"] = text
    return {"$schema": _DIALECT, **whole}


def keys(kind: str) -> list[Key]:
    """Every key of a kind of file, table by table in the order of the model."""
    return _keys(KINDS[kind], "", False)


def _keys(model: type[BaseModel], table: str, many: bool) -> list[Key]:
    told = meanings(model)
    shown = f"[[{table}]]" if many else f"[{table}]" if table else ""
    listed, below = [], []
    for name, field in model.model_fields.items():
        default = None
        if not field.is_required():
            value = field.get_default(call_default_factory=True)
            default = (
                "" if value is None or value is PydanticUndefined or isinstance(value, BaseModel) else _toml(value)
            )
        listed.append(Key(shown, name, _words(field.annotation), default, told.get(name, "")))
        for inner in models_in(field.annotation):
            # Numbers with unit and source are written in one line and explained once.
            if inner.__name__ in _INLINE:
                continue
            repeated = "list" in str(field.annotation)
            named = ".NAME" if "dict" in str(field.annotation) else ""
            below += _keys(inner, f"{table}.{name}{named}".strip("."), repeated)
    return listed + below


_INLINE = ("Number", "Triple", "Limits", "Mixer")


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value).replace("'", '"')


def _words(annotation: Any) -> str:
    """What a key takes, in words."""
    text_of_type = str(annotation)
    literals = re.findall(r"Literal\[(.*?)\]", text_of_type)
    if literals:
        allowed = [w for w in re.findall(r"'([^']*)'", literals[0]) if w]
        plain = " or ".join(w if w[0].isalnum() else f'"{w}"' for w in allowed)
        return plain + (" (list)" if text_of_type.startswith("list") else "")
    inner = models_in(annotation)
    if inner and inner[0].__name__ in _INLINE:
        return {"Number": "{ value, unit, source }", "Mixer": "{ dV, dH }"}.get(
            inner[0].__name__, "{ value = [...], unit, source }"
        )
    if inner:
        return "tables" if "list" in text_of_type else "table of tables" if "dict" in text_of_type else "table"
    for text, words in (("dict", "table"), ("list[str]", "list of texts"), ("list", "list of numbers")):
        if text in text_of_type:
            return words
    for kind, words in (("bool", "true or false"), ("int", "whole number"), ("float", "number")):
        if kind in text_of_type:
            return words
    return "text"

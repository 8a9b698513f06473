"""The contract is complete: every key of the schema of a campaign, and every column, has a case that shows it counts.

The keys are found in the models themselves, table by table, so that a key added anywhere below ``campaign.toml``
fails here until a case shows what it changes. None is left out but tables whose own keys all have cases.
"""

from __future__ import annotations

from cases_of_campaign_keys import APART, HEADER_CASES
from cases_of_source_keys import SOURCE_CASES

from ident.captive.campaign_file import CampaignFile
from ident.schemas.describe import models_in


def keys_below(model: type) -> dict[str, list[str]]:
    """``Model.key`` of a model and of all models in it -> the models that the key holds."""
    found: dict[str, list[str]] = {}
    for name, field in model.model_fields.items():
        inner = models_in(field.annotation)
        found[f"{model.__name__}.{name}"] = [m.__name__ for m in inner]
        for one in inner:
            found |= keys_below(one)
    return found


KEYS = keys_below(CampaignFile)
CASES = {*HEADER_CASES, *SOURCE_CASES}


def test_every_key_has_a_case_or_is_a_table_whose_keys_all_have():
    without = []
    for key, models in KEYS.items():
        below = [k for k in KEYS if k.split(".")[0] in models]
        if key not in CASES | APART and not (models and below and set(below) <= CASES | APART):
            without.append(key)
    assert not without


def test_no_case_is_of_a_key_that_is_none():
    assert set(KEYS) >= CASES | APART


def test_the_models_reach_as_far_as_the_schema():
    """What the JSON schema has, which editors use, the walk has too."""
    schema = CampaignFile.model_json_schema()
    names = {f"CampaignFile.{k}" for k in schema["properties"]}
    names |= {f"{m}.{k}" for m, part in schema["$defs"].items() for k in part.get("properties", {})}
    assert names == set(KEYS)

"""Slips that nobody makes on purpose, for ``mutated_files.py``: of numbers, words, keys, lines, cells, characters."""

from __future__ import annotations

import random
import re

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
_TEXT = re.compile(r'"([^"\n]*)"')
_WORDS = [
    *(
        "",
        " ",
        "0",
        "true",
        "nan",
        "[/]",
        "$\\\\bad$",
        "../x",
        "/",
        "a" * 300,
        "\\u0000",
        "\\u001b[31m",
        "%20",
        "é",
        "*",
        "[",
        "(a+)+$",
    ),
    *("hzz20", "bb2", "EXP", "psi", "m", "deg", "none", "fixed", "zigzag", "turning_circle", "sections", "utf-8"),
]
_CELLS = [
    "",
    "nan",
    "inf",
    "-1",
    "0",
    "1e9",
    "1e-9",
    "1e300",
    "x",
    "True",
    "--3",
    "1,5",
    "'",
    '"',
    "\x00",
    "９",
    "1e999",
]


def _number(rng: random.Random, text: str) -> str:
    value = float(text)
    scaled = [value * f for f in (-1.0, 0.0, 0.1, 10.0, 0.5, 2.0, 1e3, 1e-3, 1e6, 1e9, 57.3)]
    odd = ["nan", "inf", "true", '"1"', "[]", "{}", "[1, 2, 3]", "1" + "0" * 400, "-0.0", "1e-300", "1e15", "0x7f"]
    return rng.choice(odd) if rng.random() < 0.25 else f"{rng.choice(scaled):.10g}"


def mutant(rng: random.Random, text: str) -> str:
    """A text with one to three slips: of a number, a word, a key, a line, a character."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind = rng.choice(("number", "number", "number", "word", "swap words", "key", "drop", "double", "move", "byte"))
        lines = text.split("\n")
        at = rng.randrange(len(lines))
        if kind in ("number", "word"):
            found = list((_NUMBER if kind == "number" else _TEXT).finditer(text))
            if found:
                hit = rng.choice(found)
                new = _number(rng, hit[0]) if kind == "number" else f'"{rng.choice(_WORDS)}"'
                text = text[: hit.start()] + new + text[hit.end() :]
        elif kind == "swap words":
            found = list(_TEXT.finditer(text))
            if len(found) > 1:
                hit, other = rng.choice(found), rng.choice(found)
                text = text[: hit.start()] + other[0] + text[hit.end() :]
        elif kind == "key":
            found = list(re.finditer(r"(?m)^\s*(\w+)\s*=", text)) or list(re.finditer(r"\w+", text))
            hit = rng.choice(found)
            text = text[: hit.start()] + hit[0][:-2] + rng.choice("xyz") + hit[0][-2:] + text[hit.end() :]
        elif kind in ("drop", "double", "move"):
            line = lines[at]
            lines[at : at + 1] = [line, line] if kind == "double" else []
            if kind == "move":
                lines.insert(rng.randrange(len(lines) + 1), line)
            text = "\n".join(lines)
        else:
            at = rng.randrange(len(text) + 1)
            text = text[:at] + rng.choice("x-.,=[]{}\"'#\n0 9e\t\x00é;") + text[at + rng.randrange(2) :]
    return text


def mutated_table(rng: random.Random, text: str) -> str:
    """A CSV file with one to three slips: of a cell, a row, a column, a unit, or of a character."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind = rng.choice(("cell", "cell", "header", "column", "scale", "rows", "text"))
        rows = [line.split(",") for line in text.split("\n")]
        at, column = rng.randrange(len(rows)), rng.randrange(len(rows[0]))
        if kind == "text":
            text = mutant(rng, text)
            continue
        if kind == "header":
            name = rows[0][column]
            rows[0][column] = rng.choice((name.upper(), name[:-1], name + "x", "", "t", name + " [s]", "value"))
        elif kind == "cell" and column < len(rows[at]):
            rows[at][column] = rng.choice((*_CELLS, rows[at][column].upper(), rows[at][column] * 2))
        elif kind == "column":
            other = rng.randrange(len(rows[0]))
            for row in rows:
                if max(column, other) < len(row):
                    row[column], row[other] = row[other], row[column]
        elif kind == "scale":
            by = rng.choice((-1.0, 0.0, 1e-3, 1e3, 1e9, 57.3, 1.0 / 60.0))
            for row in rows[1:]:
                if column < len(row) and _NUMBER.fullmatch(row[column]):
                    row[column] = f"{by * float(row[column]):.9g}"
        elif kind == "rows":
            rows[at : at + rng.randrange(1, 40)] = []
            rows = rows or [[""]]
        text = "\n".join(",".join(row) for row in rows)
    return text

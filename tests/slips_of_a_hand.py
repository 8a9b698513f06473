"""Slips that people make in files of numbers, for ``mutated_files.py --by-hand``.

A value in another unit or with the other sign, digits that changed places, a decimal comma, lines and columns that
changed places, a key in another table, a block copied and not edited.
"""

from __future__ import annotations

import random
import re

_NUMBER = re.compile(r"(?<![\w.\"])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.\"])")
_VECTOR = re.compile(r"\[\s*-?[\d.]+e?-?\d*(?:\s*,\s*-?[\d.]+e?-?\d*)+\s*\]")
_KEY = re.compile(r"^\s*[\w-]+\s*=")
# Between m and mm, ft, in; m/s and knots; degrees and radians; 1/s and 1/min; kg and t, lb; N and kN, kgf; and halves.
_FACTORS = (1e3, 1e-3, 100.0, 0.01, 0.3048, 3.28084, 0.0254, 0.514444, 1.94384, 57.29578, 0.0174533, 60.0, 1.0 / 60.0)
_FACTORS += (0.453592, 9.80665, 0.101972, 10.0, 0.1, 2.0, 0.5)
_UNITS = ("m", "mm", "ft", "km", "kg", "t", "lb", "deg", "rad", "rps", "rpm", "s", "min", "mps", "kn", "rad/s", "deg/s")


def _of_number(rng: random.Random, text: str) -> str:
    """A number as a hand gets it wrong."""
    kind = rng.choice(("unit", "unit", "sign", "digits", "point", "zero", "comma", "exponent", "quoted"))
    if kind == "unit":
        return f"{float(text) * rng.choice(_FACTORS):.6g}"
    if kind == "sign":
        return text[1:] if text.startswith("-") else "-" + text
    if kind == "comma":
        return text.replace(".", ",")
    if kind == "quoted":
        return f'"{text}"'
    places = [k for k, c in enumerate(text) if c.isdigit()]
    if kind == "digits" and len(places) > 1:
        k = rng.randrange(len(places) - 1)
        cells = list(text)
        cells[places[k]], cells[places[k + 1]] = cells[places[k + 1]], cells[places[k]]
        return "".join(cells)
    if kind == "exponent" and "e" in text:
        return text[:-1] + str((int(text[-1]) + rng.choice((1, -1))) % 10)
    if kind == "zero":
        return text.replace(".", "0.", 1) if "." in text else text + "0"
    return text.replace(".", "", 1) if "." in text else f"{float(text) / 10.0:g}"


def _replaced(rng: random.Random, text: str, pattern: re.Pattern[str], made: object) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text
    hit = rng.choice(found)
    return text[: hit.start()] + made(hit[0]) + text[hit.end() :]  # type: ignore[operator]


def _exchanged(rng: random.Random, vector: str) -> str:
    """A vector with two of its numbers exchanged."""
    cells = vector[1:-1].split(",")
    one, other = rng.sample(range(len(cells)), 2)
    cells[one], cells[other] = cells[other], cells[one]
    return "[" + ",".join(cells) + "]"


def _of_lines(rng: random.Random, lines: list[str], kind: str) -> None:
    """Lines changed in place: exchanged, in another table, copied, left out as a comment."""
    keys = [k for k, line in enumerate(lines) if _KEY.match(line)]
    heads = [k for k, line in enumerate(lines) if line.startswith("[")]
    if not keys:
        return
    at = rng.choice(keys)
    if kind == "neighbours" and at + 1 < len(lines):
        lines[at], lines[at + 1] = lines[at + 1], lines[at]
    elif kind == "values":
        other = rng.choice(keys)
        (one, value), (two, second) = lines[at].split("=", 1), lines[other].split("=", 1)
        lines[at], lines[other] = f"{one}={second}", f"{two}={value}"
    elif kind == "table" and heads:
        line = lines.pop(at)
        heads = [k for k, text in enumerate(lines) if text.startswith("[")]
        lines.insert(rng.choice(heads) + 1, line)
    elif kind == "comment":
        lines[at] = "# " + lines[at]
    elif kind == "copy" and heads:
        first = rng.choice(heads)
        last = next((k for k in heads if k > first), len(lines))
        lines[last:last] = lines[first:last]
    elif kind == "header" and heads:
        first = rng.choice(heads)
        head = lines[first]
        lines[first] = rng.choice(
            (head.upper(), head.strip("[]"), f"[{head.strip('[]')}]", f"[[{head.strip('[]')}]]", "")
        )
    elif kind == "key":
        name = lines[at].split("=")[0].strip()
        made = (name.replace("_", "-"), name.replace("_", ""), name.title(), name + "s", name.split("_")[0])
        lines[at] = lines[at].replace(name, rng.choice(made), 1)


def statement(rng: random.Random, text: str) -> str:
    """A TOML file with one or two slips of a hand."""
    kinds = ("number",) * 6 + (
        "vector",
        "unit",
        "word",
        "values",
        "neighbours",
        "table",
        "comment",
        "copy",
        "header",
        "key",
    )
    for _ in range(rng.choice((1, 1, 1, 2))):
        kind = rng.choice(kinds)
        if kind == "number":
            text = _replaced(rng, text, _NUMBER, lambda hit: _of_number(rng, hit))
        elif kind == "vector":
            text = _replaced(rng, text, _VECTOR, lambda hit: _exchanged(rng, hit))
        elif kind == "unit":
            text = _replaced(rng, text, re.compile(r'(?<=unit = )"[^"]*"'), lambda _: f'"{rng.choice(_UNITS)}"')
        elif kind == "word":
            words = re.findall(r'= ("[^"\n]*")', text)
            word = rng.choice(words or ['""'])
            text = _replaced(rng, text, re.compile(r'(?<== )"[^"\n]*"'), lambda _, word=word: word)
        else:
            lines = text.split("\n")
            _of_lines(rng, lines, kind)
            text = "\n".join(lines)
    return text


def table(rng: random.Random, text: str) -> str:
    """A CSV file with one or two slips of a hand."""
    for _ in range(rng.choice((1, 1, 1, 2))):
        rows = [line.split(",") for line in text.rstrip("\n").split("\n")]
        column, at = rng.randrange(len(rows[0])), rng.randrange(1, max(2, len(rows)))
        kind = rng.choice(
            ("cell", "cell", "cell", "unit", "sign", "rows", "copy", "columns", "names", "lost", "note", "way")
        )
        if kind == "cell" and at < len(rows) and column < len(rows[at]) and _NUMBER.fullmatch(rows[at][column]):
            rows[at][column] = _of_number(rng, rows[at][column])
        elif kind in ("unit", "sign"):
            by, first = (rng.choice(_FACTORS) if kind == "unit" else -1.0), rng.choice((1, 1, at))
            for row in rows[first:]:
                if column < len(row) and _NUMBER.fullmatch(row[column]):
                    row[column] = f"{by * float(row[column]):.8g}"
        elif kind == "rows" and at + 1 < len(rows):
            rows[at], rows[at + 1] = rows[at + 1], rows[at]
        elif kind == "copy" and at < len(rows):
            rows.insert(at, list(rows[at]))
        elif kind in ("columns", "names"):
            other = rng.randrange(len(rows[0]))
            for row in rows if kind == "columns" else rows[:1]:
                if max(column, other) < len(row):
                    row[column], row[other] = row[other], row[column]
        elif kind == "lost":
            rows[at : at + rng.choice((1, 1, 5, len(rows) // 2))] = []
        elif kind == "note":
            rows.insert(at, rng.choice(([""], ["mean", *rows[-1][1:]], ["# remark"], ["(units)"] * len(rows[0]))))
        text = "\n".join(",".join(row) for row in rows) + "\n"
        if kind == "way":
            ways = (text.replace(",", ";").replace(".", ","), text.replace(",", "\t"), text.replace(".", ","))
            text = rng.choice((*ways, "\ufeff" + text, text.replace(",", " , "), text.replace(".", ",", 1)))
    return text

"""Slips that people make in campaign, vehicle and run files, and random ones: each with a word for its kind.

What is changed is what a hand, a spreadsheet or a script changes: a unit, a sign, an angle in radians, columns that
changed places, rows twice, a decimal comma, a factor of a thousand, a key misspelt or in another table, another
moment point, the value of another row, a row that is missing, text in a number.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable

NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")
_UNITS = {
    "N": ("kN", "lbf", "kgf", "Nm"), "Nm": ("kNm", "N", "lbf*ft"), "m": ("mm", "ft", "cm"), "mps": ("kts", "mmps"),
    "deg": ("rad",), "radps": ("degps", "rpm"), "rps": ("rpm",), "mps2": ("ftps2",), "radps2": ("degps2",),
}  # fmt: skip
_WORDS = (
    ("forward", "aft"), ("starboard", "port"), ("down", "up"), ("flight", "ittc"), ("body", "flow"), ("body", "tank"),
    ("true", "false"), ("steady", "oscillatory"), ("half_rho_L2", "half_rho_Ld"), ("history", "runs"),
    ("drift_horizontal", "drift_vertical"), ("towing", "rotating_arm"), ("hull", "propeller"), ("Y", "N"), ("X", "Z"),
    ("sway", "yaw"), ("alpha", "beta"), ("deg", "rad"), ("m/s", "kts"), ("Hz", "rad/s"),
)  # fmt: skip


def _scaled(text: str, factor: float) -> str:
    return f"{float(text) * factor:.7g}"


def _misspelt(rng: random.Random, word: str) -> str:
    if len(word) < 3:
        return word + rng.choice("xs")
    k = rng.randrange(len(word) - 1)
    return rng.choice(
        (word[:k] + word[k + 1] + word[k] + word[k + 2 :], word[:k] + word[k + 1 :], word[: k + 1] + word[k:],
         word.upper(),         word.replace("_", "-"), word.replace("_", " "), word + "s")
    )  # fmt: skip


def _digits(rng: random.Random, text: str) -> str:
    """A number typed wrong: two digits changed places, one twice, one left out, the point moved."""
    places = [i for i, c in enumerate(text) if c.isdigit()]
    k = rng.choice(places)
    if len(places) > 1 and rng.random() < 0.5:
        i = rng.randrange(len(places) - 1)
        a, b = places[i], places[i + 1]
        return text[:a] + text[b] + text[a + 1 : b] + text[a] + text[b + 1 :]
    return rng.choice(
        (text[:k] + text[k] + text[k:], text[:k] + text[k + 1 :], text.replace(".", ""), _scaled(text, 10.0))
    )


class Table:
    """A table of text as its lines and cells, delimiter as found."""

    def __init__(self, text: str) -> None:
        first = text.split("\n", 1)[0]
        self.mark = ";" if first.count(";") > first.count(",") else "\t" if "\t" in first else ","
        self.rows = [line.split(self.mark) for line in text.split("\n")]

    @property
    def text(self) -> str:
        return "\n".join(self.mark.join(row) for row in self.rows)

    def numeric(self, names: str = "") -> list[int]:
        """Columns of numbers, of these names where given."""
        head = self.rows[0]
        some = [r for r in self.rows[1:6] if len(r) == len(head)]
        good = [c for c in range(len(head)) if some and all(NUMBER.fullmatch(r[c].strip() or "0") for r in some)]
        good = [c for c in good if any(r[c].strip() for r in some)]
        return [c for c in good if not names or re.match(names, head[c])]

    def body(self, column: int) -> list[int]:
        """Rows that have a number there."""
        return [i for i, r in enumerate(self.rows) if i and column < len(r) and NUMBER.fullmatch(r[column].strip())]

    def map(self, column: int, change: Callable[[str], str], some: list[int] | None = None) -> None:
        for i in self.body(column) if some is None else some:
            self.rows[i][column] = change(self.rows[i][column])


def _unit(rng: random.Random, t: Table) -> None:
    places = [(c, m) for c, h in enumerate(t.rows[0]) for m in re.finditer(r"_([A-Za-z0-9]+)$|[\[(]([^\])]+)[\])]", h)]
    places = [(c, m) for c, m in places if (m[1] or m[2]) in _UNITS]
    c, m = rng.choice(places)
    head = t.rows[0][c]
    at = 1 if m[1] else 2
    t.rows[0][c] = head[: m.start(at)] + rng.choice(_UNITS[m[at]]) + head[m.end(at) :]


def _factor(rng: random.Random, t: Table) -> None:
    by = rng.choice((1e3, 1e-3, 10.0, 0.1, 4.448222, 1 / 4.448222, 9.80665, 0.514444, 1.943844))
    t.map(rng.choice(t.numeric()), lambda x: _scaled(x, by))


def _radians(rng: random.Random, t: Table) -> None:
    by = rng.choice((math.pi / 180.0, 180.0 / math.pi))
    t.map(rng.choice(t.numeric("alpha|beta|plane|[pqr]|delta|Angle")), lambda x: _scaled(x, by))


def _sign(rng: random.Random, t: Table) -> None:
    t.map(rng.choice(t.numeric()), lambda x: x[1:] if x.startswith("-") else "-" + x if float(x) else x)


def _sign_of_one(rng: random.Random, t: Table) -> None:
    c = rng.choice(t.numeric())
    t.map(c, lambda x: x[1:] if x.startswith("-") else "-" + x, [rng.choice(t.body(c))])


def _names_swapped(rng: random.Random, t: Table) -> None:
    i, j = rng.sample(t.numeric(), 2)
    t.rows[0][i], t.rows[0][j] = t.rows[0][j], t.rows[0][i]


def _rows_twice(rng: random.Random, t: Table) -> None:
    at = rng.randrange(1, len(t.rows))
    size = rng.choice((1, 1, 3, len(t.rows)))
    t.rows[at:at] = [list(r) for r in t.rows[at : at + size]]


def _rows_twice_renamed(rng: random.Random, t: Table) -> None:
    """A block copied below itself, with run numbers that go on."""
    at = rng.randrange(1, len(t.rows))
    copies = [[r[0] + "b", *r[1:]] for r in t.rows[at : at + rng.choice((1, 2, 6))] if len(r) > 1]
    t.rows[at:at] = copies


def _rows_missing(rng: random.Random, t: Table) -> None:
    at = rng.randrange(0, len(t.rows))
    del t.rows[at : at + rng.choice((1, 1, 1, 2, len(t.rows) // 2))]


def _decimal_comma(rng: random.Random, t: Table) -> None:
    c = rng.choice(t.numeric())
    some = t.body(c) if rng.random() < 0.5 else [rng.choice(t.body(c))]
    t.map(c, lambda x: x.replace(".", ","), some)


def _other_row(rng: random.Random, t: Table) -> None:
    c = rng.choice(t.numeric())
    i, j = rng.choice(t.body(c)), rng.choice(t.body(c))
    t.rows[i][c] = t.rows[j][c]


def _text(rng: random.Random, t: Table) -> None:
    c = rng.choice(t.numeric())
    said = ("n/a", "-", "--", "{}*", "ca. {}", "{} N", "{}e", "< {}", "{} ", "#DIV/0!", "#REF!", "NaN", "{}?", "~{}",
            "", "o{}", "{}\u00b1", "({})", "{}-", "1 {}", "{}.", "+{}", "'{}", "=B2*2")  # fmt: skip
    t.map(c, lambda x: rng.choice(said).format(x), [rng.choice(t.body(c))])


def _header(rng: random.Random, t: Table) -> None:
    c = rng.randrange(len(t.rows[0]))
    t.rows[0][c] = _misspelt(rng, t.rows[0][c])


def _typed(rng: random.Random, t: Table) -> None:
    c = rng.choice(t.numeric())
    t.map(c, lambda x: _digits(rng, x), [rng.choice(t.body(c))])


def _shifted(rng: random.Random, t: Table) -> None:
    """A column a row lower than the others."""
    c = rng.choice(t.numeric())
    rows = t.body(c)
    values = [t.rows[i][c] for i in rows]
    values = [values[-1], *values[:-1]]
    for i, v in zip(rows, values, strict=True):
        t.rows[i][c] = v


def _sorted(rng: random.Random, t: Table) -> None:
    """One column sorted by itself."""
    c = rng.choice(t.numeric())
    rows = t.body(c)
    for i, v in zip(rows, sorted((t.rows[i][c] for i in rows), key=float), strict=True):
        t.rows[i][c] = v


def _filled_down(rng: random.Random, t: Table) -> None:
    c = rng.choice(t.numeric())
    rows = t.body(c)
    at = rng.randrange(len(rows))
    for i in rows[at : at + rng.choice((2, 3, 5, len(rows)))]:
        t.rows[i][c] = t.rows[rows[at]][c]


def _column_gone(rng: random.Random, t: Table) -> None:
    c = rng.randrange(len(t.rows[0]))
    for r in t.rows:
        del r[c : c + 1]


def _offset(rng: random.Random, t: Table) -> None:
    """A zero that was not taken off: a load, or the angle, off by a fraction of its range."""
    c = rng.choice(t.numeric("[XYZKMN]|alpha|beta|plane"))
    values = [float(t.rows[i][c]) for i in t.body(c)]
    by = rng.choice((0.1, 0.3, -0.2)) * max(map(abs, values))
    t.map(c, lambda x: f"{float(x) + by:.7g}")


def _word(rng: random.Random, t: Table) -> None:
    words = [(i, c) for i, r in enumerate(t.rows) for c, x in enumerate(r) if i and re.fullmatch(r"[a-z_]{3,}", x)]
    i, c = rng.choice(words)
    others = sorted(
        {t.rows[k][m] for k, m in words} | {"towing", "hull", "rotating_arm", "propeller", "drift_vertical"}
    )
    new = rng.choice(others)
    for k in range(i, len(t.rows)) if rng.random() < 0.5 else [i]:
        if c < len(t.rows[k]):
            t.rows[k][c] = new


OF_TABLES: dict[str, Callable[[random.Random, Table], None]] = {
    "unit in a header": _unit,
    "factor in a column": _factor,
    "degrees and radians": _radians,
    "sign of a column": _sign,
    "sign of a value": _sign_of_one,
    "columns swapped": _names_swapped,
    "rows twice": _rows_twice,
    "rows twice, renamed": _rows_twice_renamed,
    "rows missing": _rows_missing,
    "decimal comma": _decimal_comma,
    "value of another row": _other_row,
    "text in a number": _text,
    "header misspelt": _header,
    "number typed wrong": _typed,
    "column a row lower": _shifted,
    "column sorted alone": _sorted,
    "filled down": _filled_down,
    "column gone": _column_gone,
    "zero not taken off": _offset,
    "word of another kind": _word,
}


# -- TOML ------------------------------------------------------------------------------------------


def _numbers(text: str) -> list[re.Match[str]]:
    found = []
    for hit in NUMBER.finditer(text):
        line = text[text.rfind("\n", 0, hit.start()) + 1 : hit.start()]
        if "#" not in line and "=" in line:
            found.append(hit)
    return found


def _keys(text: str) -> list[re.Match[str]]:
    return list(re.finditer(r"(?m)^[ \t]*([\w\"'|.\- ]+?)[ \t]*=", text))


def _put(text: str, hit: re.Match[str], new: str, group: int = 0) -> str:
    return text[: hit.start(group)] + new + text[hit.end(group) :]


def _toml_number(rng: random.Random, text: str) -> str:
    hit = rng.choice(_numbers(text))
    x = hit[0]
    new = rng.choice(
        (_scaled(x, 1e3), _scaled(x, 1e-3), _scaled(x, 10.0), _scaled(x, 0.1), _scaled(x, math.pi / 180.0),
         _scaled(x, 180.0 / math.pi), x[1:] if x.startswith("-") else "-" + x, x.replace(".", ","), _digits(rng, x),
         f"{1.0 / float(x):.6g}" if float(x) else "1.0", _scaled(x, 0.3048), f'"{x}"', f"{x} m", "",
         _scaled(x, 2.0), "0.0")
    )  # fmt: skip
    return _put(text, hit, new)


def _point(rng: random.Random, text: str) -> str:
    hits = list(re.finditer(r"(?m)^[xyz]_m *= *(\S+)", text))
    hit = rng.choice(hits)
    x = float(hit[1])
    new = rng.choice((x + 0.3, x - 0.3, x + 2.5, -x or 1.0, 1e3 * x or 250.0, x + 0.05, x + 30.0))
    return _put(text, hit, f"{new:.6g}", 1)


def _toml_key(rng: random.Random, text: str) -> str:
    hit = rng.choice(_keys(text))
    return _put(text, hit, _misspelt(rng, hit[1]), 1)


def _toml_moved(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    at = rng.choice([i for i, line in enumerate(lines) if re.match(r"^[\w\" ]+=", line)])
    line = lines.pop(at)
    heads = [i for i, x in enumerate(lines) if x.startswith("[")] or [0]
    lines.insert(rng.choice(heads) + 1, line)
    return "\n".join(lines)


def _toml_word(rng: random.Random, text: str) -> str:
    pairs = [(a, b) for pair in _WORDS for a, b in (pair, pair[::-1]) if re.search(rf"(?<![\w]){a}(?![\w])", text)]
    old, new = rng.choice(pairs)
    hits = list(re.finditer(rf"(?<![\w]){old}(?![\w])", text))
    return _put(text, rng.choice(hits), new)


def _toml_lines(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    kind = rng.choice(("drop", "twice", "comment", "swap"))
    if kind == "drop":
        del lines[at]
    elif kind == "twice":
        lines.insert(at, lines[at])
    elif kind == "comment":
        lines[at] = "# " + lines[at]
    else:
        k = rng.randrange(len(lines))
        lines[at], lines[k] = lines[k], lines[at]
    return "\n".join(lines)


def _toml_exchanged(rng: random.Random, text: str) -> str:
    """Two numbers that changed places."""
    one, two = sorted(rng.sample(_numbers(text), 2), key=lambda h: h.start())
    return text[: one.start()] + two[0] + text[one.end() : two.start()] + one[0] + text[two.end() :]


OF_TOML: dict[str, Callable[[random.Random, str], str]] = {
    "number in another unit or typed wrong": _toml_number,
    "number ": _toml_number,
    "number  ": _toml_number,
    "moment point": _point,
    "key misspelt": _toml_key,
    "key in another table": _toml_moved,
    "another word": _toml_word,
    "another word ": _toml_word,
    "line": _toml_lines,
    "numbers exchanged": _toml_exchanged,
}


def at_random(rng: random.Random, text: str) -> str:
    """A slip that no person would make: characters, cuts, words from elsewhere in the file."""
    kind = rng.choice(("letter", "letter", "cut", "word", "piece", "line"))
    at = rng.randrange(len(text) + 1)
    if kind == "letter":
        return text[:at] + rng.choice("abXYZ_-.,;'\"= \t0123456789[]{}()%#\u00e9\x00") + text[at + rng.randrange(2) :]
    if kind == "cut":
        return text[:at]
    if kind == "word":
        words = re.findall(r"[A-Za-z_]{2,}", text) or ["x"]
        old, new = rng.choice(words), rng.choice(words)
        return re.sub(rf"\b{old}\b", new, text, count=1)
    if kind == "piece":
        to = rng.randrange(len(text) + 1)
        a, b = min(at, to), min(max(at, to), min(at, to) + 60)
        return text[:a] + text[b:] if rng.random() < 0.5 else text[:b] + text[a:b] + text[b:]
    lines = text.split("\n")
    rng.shuffle(lines) if rng.random() < 0.1 else lines.insert(rng.randrange(len(lines)), rng.choice(lines))
    return "\n".join(lines)


def slipped(rng: random.Random, name: str, text: str) -> tuple[str, str]:
    """The kind of a slip, and the text with it; a slip that the file has no place for is another one."""
    for _ in range(30):
        if rng.random() < 0.2:
            return "random", at_random(rng, text)
        try:
            if name.endswith(".toml"):
                kind = rng.choice(list(OF_TOML))
                made = OF_TOML[kind](rng, text)
            else:
                kind = rng.choice(list(OF_TABLES))
                table = Table(text)
                OF_TABLES[kind](rng, table)
                made = table.text
        except (IndexError, ValueError, KeyError):
            continue
        if made != text:
            return kind.strip(), made
    return "random", at_random(rng, text)

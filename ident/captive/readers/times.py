"""Clock times and dates in the time column of a history, as seconds."""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass

_TIME = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)\s*([AaPp][Mm])?|(\d{1,3}):(\d{2}[.,]\d+)")
# 20200501T120000.5, 01-May-2020, and microseconds or nanoseconds of an epoch.
_BASIC = re.compile(r"(\d{4})(\d{2})(\d{2})T(\d{2})(\d{2})(\d{2}(?:[.,]\d+)?)")
_NAMED = re.compile(r"(\d{1,2})[-. ](Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sep|Oct|Nov|Dec)[a-z]*[-. ](\d{4})", re.IGNORECASE)
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_EPOCH = re.compile(r"\d{16}(?:\d{3})?", re.ASCII)
_DATE = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})|(\d{1,2})([-/.])(\d{1,2})[-/.](\d{2,4})")
_ZONE = re.compile(r"(?:Z|UTC|[+-]\d{2}:?\d{2})$")
_DAY = 86400.0
FORMS = "hh:mm:ss, mm:ss.s, or a date and time (2019-03-04T23:59:55.050, 04-Mar-2019 23:59:55)"
# Numbers that are no seconds: days of a spreadsheet between 1950 and 2120, milliseconds and microseconds of an epoch.
_SERIAL = (18_000.0, 80_000.0)
_FINE = 1e-3
_MILLI, _MICRO, _NANO = 1e11, 1e14, 1e17


@dataclass
class Clocks:
    """Reads clock times one after the other; midnight and the date of the first row are kept in mind."""

    day: datetime.date | None = None
    last: float = 0.0
    midnights: int = 0

    def seconds(self, cell: str) -> float | None:
        """Seconds since the midnight before the first row; None for what is no time.

        A time of day alone that falls back by more than half a day has passed midnight. Dates written
        with the day or the month first are only compared with the first row's, so that both orders
        are read alike as long as the record stays within a month.
        """
        text = _ZONE.sub("", cell.strip()).strip()
        if _EPOCH.fullmatch(text):
            return int(text) / (1e6 if len(text) == 16 else 1e9)
        text = _BASIC.sub(r"\1-\2-\3T\4:\5:\6", text)
        text = _NAMED.sub(lambda m: f"{m[3]}-{_MONTHS.index(m[2].lower()) + 1}-{m[1]}", text)
        date = _DATE.match(text)
        rest = text[date.end() :].lstrip("T ,;_-") if date else text
        time = _TIME.fullmatch(rest)
        if time is None:
            return None
        of_day = _of_day(time)
        if date is None:
            if of_day < self.last - 0.5 * _DAY:
                self.midnights += 1
            self.last = of_day
            return of_day + _DAY * self.midnights
        day = _day(date)
        if day is None:
            return None
        if self.day is None:
            self.day = day
        return of_day + _DAY * (day - self.day).days


def _of_day(time: re.Match[str]) -> float:
    if time[5] is not None:
        return 60.0 * int(time[5]) + float(time[6].replace(",", "."))
    hours, half = int(time[1]), (time[4] or "").lower()
    hours = hours % 12 + (12 if half == "pm" else 0) if half else hours
    return 3600.0 * hours + 60.0 * int(time[2]) + float(time[3].replace(",", "."))


def _day(date: re.Match[str]) -> datetime.date | None:
    try:
        if date[1] is not None:
            return datetime.date(int(date[1]), int(date[2]), int(date[3]))
        first, second, year = int(date[4]), int(date[6]), int(date[7])
        year += 2000 if year < 100 else 0
        # With slashes the month stands first in the United States; elsewhere the day does.
        if (date[5] == "/" and first <= 12) or second > 12:
            first, second = second, first
        return datetime.date(year, second, first)
    except ValueError:
        return None


def unit_of(first: float, second: float) -> tuple[float, str] | None:
    """Factor to seconds of stamps that cannot be seconds, and what they are in words; None for others.

    Parameters
    ----------
    first, second : The first two stamps, under a header or a declaration that says seconds.
    """
    step = abs(second - first)
    for least, factor, words in ((_NANO, 1e-9, "nano"), (_MICRO, 1e-6, "micro"), (_MILLI, 1e-3, "milli")):
        if first > least and second > least:
            return factor, f"{words}seconds of an epoch"
    if _SERIAL[0] < first < _SERIAL[1] and first != round(first) and 0.0 < step < _FINE:
        return _DAY, "serial days of a spreadsheet"
    return None

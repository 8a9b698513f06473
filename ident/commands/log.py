"""The log of the program on standard error: what each step of a command did, one line an event."""

from __future__ import annotations

import json
import logging
from datetime import UTC, datetime
from typing import Any

import click

LEVELS = ("debug", "info", "warning", "error")
# What every record has; the rest was given with the event.
_EVERY = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName"}
_PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-+/:,")
# Those of the program; of the libraries beneath it only warnings count.
_NAMES = ("ident", "sim")


def _value(given: object) -> str:
    """A value as one word, in quotes where it is more."""
    text = f"{given:.6g}" if isinstance(given, float) else str(given)
    return text if text and set(text) <= _PLAIN else json.dumps(text)


class Lines(logging.Formatter):
    """Time (UTC), level, module, what happened, and ``key=value`` of what it happened to."""

    def format(self, record: logging.LogRecord) -> str:
        """One line, and the trace of an error below it."""
        time = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        given = [f"{k}={_value(v)}" for k, v in vars(record).items() if k not in _EVERY]
        said = json.dumps(record.getMessage(), ensure_ascii=False)[1:-1].replace('\\"', '"')
        line = " ".join([time, record.levelname.lower(), record.name, said, *given])
        return f"{line}\n{self.formatException(record.exc_info)}" if record.exc_info else line


class _Screen(logging.Handler):
    """Standard error as it is when something is said."""

    def emit(self, record: logging.LogRecord) -> None:
        click.echo(self.format(record), err=True)


def begin(level: str) -> None:
    """Log events of the program of a level and above from here on, and warnings of its libraries."""
    handler = _Screen()
    handler.setFormatter(Lines())
    for name in (*_NAMES, "py.warnings"):
        logger = logging.getLogger(name)
        for old in [h for h in logger.handlers if isinstance(h, _Screen)]:
            logger.removeHandler(old)
        logger.addHandler(handler)
        logger.setLevel(getattr(logging, level.upper()))
    logging.captureWarnings(True)


def log_level(context: click.Context, parameter: click.Parameter, value: str | None) -> Any:
    """The option ``--log-level`` taken up as soon as it is read."""
    if value is not None:
        begin(value)
    return value

"""Authority: the shell's exit codes of signals: 128 + 2 after Ctrl-C, 128 + 15 after SIGTERM, within two seconds.

Wherever the command is: in Python, in native code that looks at no signal, or waiting for a pool of threads.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

_WORK = {
    "in Python": "while True:\n        pass",
    # A join of a thread and a sleep in C return to Python when they are done only.
    "in native code": "import ctypes\n    ctypes.CDLL(None).sleep(60)\n    ctypes.CDLL(None).sleep(60)",
    "in a pool": (
        "import ctypes\n    from concurrent.futures import ThreadPoolExecutor\n"
        "    with ThreadPoolExecutor(2) as pool:\n"
        "        list(pool.map(lambda _: [ctypes.CDLL(None).usleep(900000) for _ in range(40)], range(50)))"
    ),
}
_COMMAND = """
import sys
import click
from ident.cli import Commands

@click.group(cls=Commands)
def main():
    pass

@main.command()
def work():
    print("begun", flush=True)
    {work}

main(["work"])
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("work", list(_WORK))
def test_a_command_ends_with_the_code_of_its_signal(work, number):
    script = _COMMAND.format(work=_WORK[work])
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env)
    try:
        assert process.stdout.readline() == b"begun\n"
        time.sleep(0.3)
        begun = time.monotonic()
        process.send_signal(number)
        _, said = process.communicate(timeout=30)
        # Two seconds, and what a machine at work on other things adds.
        assert time.monotonic() - begun < 5.0
    finally:
        process.kill()
    assert process.returncode == 128 + number
    assert b"Traceback" not in said

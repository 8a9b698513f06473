"""Imported before all else where the program starts: Ctrl-C during its imports ends it, and is not lost.

Python raises it wherever it is, also where nothing can be raised: there it is printed and forgotten.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

# A program of the user's own that imports the command line keeps its handler.
_OURS = ("ident", "cli.py")

# Where there are no signals of POSIX nobody takes the handler back (``ident.commands.process``).
if (
    os.name == "posix"
    and os.path.basename(sys.argv[0]) in _OURS
    and threading.current_thread() is threading.main_thread()
):
    signal.signal(signal.SIGINT, signal.SIG_DFL)

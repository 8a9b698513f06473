"""Imported before all else where the program starts: Ctrl-C during its imports ends it, and is not lost.

Python raises it wherever it is, also where nothing can be raised: there it is printed and forgotten.

At the end of the program nothing is cleared up object by object: the system takes all memory at once.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading

# A program of the user's own that imports the command line keeps its handler.
_OURS = ("ident", "cli.py")

if os.path.basename(sys.argv[0]) in _OURS:
    # What the libraries hold is not looked through once more for objects to delete: a third of a second.
    atexit.register(gc.freeze)
    # Where there are no signals of POSIX nobody takes the handler back (``ident.commands.process``).
    if os.name == "posix" and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)

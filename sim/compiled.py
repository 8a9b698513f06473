"""How the simulator's functions are compiled, and kept from one start to the next."""

from __future__ import annotations

import contextlib
import hashlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit, typeof
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.registry import cpu_target

from sim.compiled_cache import cache_place, end_turn, is_ours, take_turn

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
# Counting the references of arrays that are only handed on takes longer than the right-hand side in waves.
_UNCOUNTED: dict[str, Any] = {"_nrt": False}
_INSIDE: dict[str, Any] = {"no_cpython_wrapper": True, **_UNCOUNTED}
# Of an implementation that is chosen by type, and of one that becomes a part of its caller.
CHOSEN: Any = {**_OPTIONS, **_INSIDE}
CHOSEN_INLINED: Any = {**CHOSEN, "forceinline": True}
_PACKAGE = Path(__file__).resolve().parent
# Time to compile the right-hand side and the loop around it [s], said beforehand; in waves so much beside it.
_CALM, _WAVES = 10, 20


class _Locator:
    """Tells numba where a function is kept: by module and line, wherever the file lies."""

    def __init__(self, function: Callable[..., Any], place: Path) -> None:
        self._py_file = function.__code__.co_filename
        self._name = f"{function.__module__}-{function.__code__.co_firstlineno}"
        self._place = place

    def ensure_cache_path(self) -> None:
        """Nothing to do: the folder was made when it was chosen."""

    def get_cache_path(self) -> str:
        """Folder of this state of the sources."""
        return str(self._place)

    def get_source_stamp(self) -> str:
        """The name of the folder, a digest of all sources; with the own file's where it is not one of them."""
        file = Path(self._py_file)
        if _PACKAGE in file.resolve().parents:
            return self._place.name
        return f"{self._place.name} {hashlib.sha256(file.read_bytes()).hexdigest()}"

    def get_disambiguator(self) -> str:
        """Module and line."""
        return self._name

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Locator | None:
        """A locator, or None where nothing can be kept."""
        place = cache_place(_PACKAGE)
        return None if place is None else cls(function, place)


class _Result(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012


class _Files(IndexDataCacheFile):
    """Index and data of a function; what another could have written is not read."""

    def _load_index(self) -> dict[Any, str]:
        return dict(super()._load_index()) if is_ours(Path(self._index_path)) else {}

    def _load_data(self, name: str) -> Any:
        if not is_ours(Path(self._data_path(name))):
            raise OSError(f"{name} is not the user's own")
        return super()._load_data(name)


class _Cache(FunctionCache):
    """Compiled functions of one Python function, on disk."""

    _impl_class = _Result

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._place = Path(self._cache_path)
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp())

    def holds(self, sig: Any, target_context: Any) -> bool:
        """Whether a function is kept for types of arguments, without reading it."""
        try:
            return self._index_key(sig, target_context.codegen()) in self._cache_file._load_index()
        except Exception:
            # As for ``load_overload``.
            return False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """A kept function, or one that another process is compiling now; None when it is for this one to compile."""
        kept = self._read(sig, target_context)
        if kept is None:
            _announce(self._py_func, sig, _ONCE)
            take_turn(self._place, self._turn(sig))
            kept = self._read(sig, target_context)
            if kept is not None:
                end_turn(self._place, self._turn(sig))
        return kept

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a function; without room for it nothing is kept."""
        # The index of a function is read, added to and written again.
        take_turn(self._place, self._impl.filename_base)
        self._write(sig, data)
        end_turn(self._place, self._impl.filename_base)
        end_turn(self._place, self._turn(sig))

    def _turn(self, sig: Any) -> str:
        return f"{self._impl.filename_base} {sig}"

    def _read(self, sig: Any, target_context: Any) -> Any:
        """A kept function; a damaged file is thrown away."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:
            # Truncated, foreign or unreadable: whatever a damaged pickle raises.
            self._throw_away()
            return None

    def _write(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError:
            self.disable()
        except Exception:
            # A damaged index.
            self._throw_away()
            with contextlib.suppress(OSError):
                super().save_overload(sig, data)

    def _throw_away(self) -> None:
        for path in self._place.glob(f"{self._impl.filename_base}.*"):
            with contextlib.suppress(OSError):
                path.unlink()


class _NoCache:
    """Says that nothing is kept; otherwise as numba's own."""

    cache_path = None

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def holds(self, sig: Any, target_context: Any) -> bool:
        # What another process compiles could not be read.
        return True

    def load_overload(self, sig: Any, target_context: Any) -> None:
        _announce(self._function, sig, "at every start, as no folder of your own can keep it")

    def save_overload(self, sig: Any, data: Any) -> None:
        pass

    def enable(self) -> None:
        pass

    def disable(self) -> None:
        pass

    def flush(self) -> None:
        pass


def _kept(function: F, **options: Any) -> F:
    compiled = njit(**_OPTIONS, **options)(function)
    compiled._cache = _LazyCache(function)
    return cast(F, compiled)


class _LazyCache:
    """The cache of a function once it is asked for: an import reads no sources."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        self._made: Any = None

    def __getattr__(self, name: str) -> Any:
        if self._made is None:
            self._made = _Cache(self._function) if cache_place(_PACKAGE) else _NoCache(self._function)
        return getattr(self._made, name)


_LOOPS = {"integrate", "hold", "fill_rate", "step"}
_ONCE, _IN_CALM, _IN_WAVES = "once per installation", "in calm water", "in waves"
_said: set[str] = set()
_log = logging.getLogger(__name__)


def say_nothing() -> None:
    """For a process that compiles for another, which says itself what takes so long."""
    _said.update((_IN_CALM, _IN_WAVES))


def _announce(function: Callable[..., Any], sig: Any, how_often: str) -> None:
    """Say what takes so long, once a process for each of calm water and waves."""
    waves = "Near(" in str(sig)
    where = _IN_WAVES if waves else _IN_CALM
    if function.__name__ in _LOOPS and where not in _said:
        _said.add(where)
        seconds = _WAVES if waves else _CALM
        _log.warning("compiling the right-hand side %s, %s, about %s s", where, how_often, seconds)


def is_kept(function: Any, *arguments: Any) -> bool:
    """Whether a compiled function is kept for the types of the arguments, or nothing can be; it is not read."""
    return bool(function._cache.holds(tuple(map(typeof, arguments)), cpu_target.target_context))


def compile_for(function: Any, *arguments: Any) -> None:
    """Compile a function for the types of the arguments, and keep it, without calling it."""
    function.compile(tuple(map(typeof, arguments)))


def outer(function: F) -> F:
    """Compile what is called from Python, and by other compiled functions; it can make no array."""
    return _kept(function, **_UNCOUNTED)


def making(function: F) -> F:
    """As ``outer``, for what makes arrays and therefore counts references."""
    return _kept(function, _nrt=True)


def inner(function: F) -> F:
    """Compile what other compiled functions call only: without a door to Python a third less work."""
    return _kept(function, **_INSIDE)


def inlined(function: F) -> F:
    """Compile what becomes a part of its caller, so that no array is handed over.

    A call with seven arrays takes 50 ns, a tenth of a right-hand side.
    """
    return _kept(function, **_INSIDE, forceinline=True)


def merged(function: F) -> F:
    """Become a part of the caller before that is compiled: for what is called in one place.

    It is typed with its caller, and nothing is compiled twice. The sums stay those of a call.
    """
    return cast(F, njit(inline="always", **_OPTIONS, **_INSIDE)(function))


def fast(liberties: set[str]) -> Callable[[F], F]:
    """As ``inner``, with the liberties that the compiler may take with the order of sums."""
    return lambda function: _kept(function, **_INSIDE, fastmath=liberties)

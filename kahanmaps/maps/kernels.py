"""The kernels for many orbits: numpy, always available, or machine code by numba or its compiler (extra `fast`)."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

from kahanmaps.errors import InputError

KERNELS = ("numpy", "numba")


@cache
def has_numba() -> bool:
    """Return whether numba is installed (without importing it)."""
    return find_spec("numba") is not None


@cache
def has_llvm() -> bool:
    """Return whether numba's compiler is installed in a sufficient version: llvmlite 0.45 (numba 0.62)."""
    from importlib.metadata import PackageNotFoundError, version  # imported only here, since this is slow

    try:
        return tuple(map(int, version("llvmlite").split(".")[:2])) >= (0, 45)
    except (PackageNotFoundError, ValueError):
        return False


def choose_kernel(requested: str | None, is_long: bool) -> str:
    """Return `requested`; by default "numba" if installed and `is_long` is True, else "numpy". May raise InputError.

    >>> choose_kernel("numpy", is_long=True), choose_kernel(None, is_long=False)
    ('numpy', 'numpy')
    """
    if requested not in (None, *KERNELS):
        raise InputError(f"found the kernel {requested!r}, expected {' or '.join(KERNELS)}")
    if requested == "numba" and not has_numba():
        raise InputError("the kernel numba needs numba: pip install 'kahanmaps[fast]', or use the kernel numpy")
    return requested or ("numba" if is_long and has_numba() else "numpy")

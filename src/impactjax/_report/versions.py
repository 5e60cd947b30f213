"""Versions of the software that a result depends on."""

import importlib.metadata
import platform

_PACKAGES = ("impactjax", "jax", "jaxlib", "diffrax", "numpy", "scipy")


def versions() -> dict[str, str]:
    """The versions of Python and of the packages that compute."""
    found = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return {"python": platform.python_version(), **found}

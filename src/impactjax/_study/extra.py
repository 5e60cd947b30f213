"""Packages that only some studies need."""

import importlib
from types import ModuleType


def needed(module: str) -> ModuleType:
    """A module of the extra `studies`. Raises `ImportError` if it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(
            f"This needs {package}: `pip install 'impactjax[studies]'` installs it."
        ) from error

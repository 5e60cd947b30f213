"""Colours of the figures."""

from collections.abc import Sequence

RECORDED, FITTED, OTHER, FAINT = "#8fa3b5", "#b3261e", "#1f4e79", "#d9e0e7"
LAWS: Sequence[str] = (
    *("#b3261e", "#1f4e79", "#2e7d32", "#8a5a00", "#6a3d9a", "#00838f"),
    *("#c2185b", "#5d4037", "#546e7a", "#9e9d24", "#ef6c00", "#283593", "#000000"),
)
"""Colours of the laws, in their order."""

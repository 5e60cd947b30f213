"""Whole numbers that describe a design."""

from impactjax._refusal import whole


def as_count(size: int) -> int:
    """A number of lanes, from 1 on."""
    return whole("size", size)


def as_power_of_two(size: int) -> int:
    """A power of 2. Raises `ValueError` for other numbers."""
    number = whole("size", size)
    if number & (number - 1):
        raise ValueError(f"Argument `size` must be a power of 2, but it is {size!r}.")
    return number


def as_seed(seed: int) -> int:
    """A random seed, from 0 on."""
    return whole("seed", seed, 0)

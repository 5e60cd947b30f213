"""Whole numbers that describe a design."""


def is_whole(number: object, least: int) -> bool:
    """True for a whole number from some least one on."""
    return isinstance(number, int) and not isinstance(number, bool) and number >= least


def as_count(size: int, name: str = "size") -> int:
    """A whole number from 1 on. Raises `ValueError` for others."""
    if not is_whole(size, 1):
        raise ValueError(f"Argument `{name}` must be a whole number from 1 on, but it is {size!r}.")
    return size


def as_power_of_two(size: int) -> int:
    """A power of 2. Raises `ValueError` for other numbers."""
    if not is_whole(size, 1) or size & (size - 1):
        raise ValueError(f"Argument `size` must be a power of 2, but it is {size!r}.")
    return size


def as_seed(seed: int) -> int:
    """A random seed: a whole number from 0 on. Raises `ValueError` for others."""
    if not is_whole(seed, 0):
        raise ValueError(f"Argument `seed` must be a whole number from 0 on, but it is {seed!r}.")
    return seed

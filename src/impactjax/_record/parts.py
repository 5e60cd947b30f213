"""Parts of a table, each with its own clock: runs or bodies side by side."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactjax._record.header import FRAME, Header
from impactjax._record.table import Table
from impactjax._sensor.quantity import TIME


class Part(NamedTuple):
    """A run or a body in a table: positions of its columns, and the parts of their headers.

    - `name`: name of the run or body; its number if it has none.
    - `clocks`: positions of the columns of time, or of frames.
    - `values`: positions of the other columns.
    """

    name: str
    headers: dict[int, Header]
    clocks: list[int]
    values: list[int]

    @property
    def known(self) -> list[int]:
        """Positions of the columns of known quantities."""
        return [i for i in self.values if self.headers[i].quantity is not None]


def parts(table: Table, headers: Sequence[Header]) -> list[Part]:
    """The parts of a table.

    Columns with the name of a run in their header belong to that run; others to the clock on their
    left. A run without a clock has that of the others. Clocks that are equal are one.
    """
    named: dict[str, Part] = {}
    blocks = [Part("1", {}, [], [])]
    for i, header in enumerate(headers):
        if header.run:
            part = named.setdefault(header.run, Part(header.run, {}, [], []))
        else:
            last = blocks[-1]
            if _is_clock(header) and last.clocks and last.values:
                blocks.append(Part(str(len(blocks) + 1), {}, [], []))
            part = blocks[-1]
        part.headers[i] = header
        (part.clocks if _is_clock(header) else part.values).append(i)
    blocks = _merged(table, blocks)
    if not named:
        return blocks
    shared = [i for block in blocks for i in block.clocks]
    for part in named.values():
        if not part.clocks:
            part.clocks.extend(shared)
            part.headers.update({i: headers[i] for i in shared})
    return [*named.values(), *(block for block in blocks if block.known)]


def longest(table: Table, found: Sequence[Part]) -> Part:
    """The part with most samples; of several, the first."""
    return max(found, key=lambda part: samples(table, part))


def samples(table: Table, part: Part) -> int:
    """The largest number of cells in a column of a known quantity that varies."""
    varied = [i for i in part.known if table.varies(i)]
    return max((table.count(i) for i in varied), default=0)


def _is_clock(header: Header) -> bool:
    return header.quantity in (TIME, FRAME)


def _merged(table: Table, blocks: list[Part]) -> list[Part]:
    """Parts of which those with equal clocks are one."""
    kept = blocks[:1]
    for block in blocks[1:]:
        same = [each for each in kept if _same_clock(table, each, block)]
        if same:
            same[0].headers.update({i: block.headers[i] for i in block.values})
            same[0].values.extend(block.values)
        else:
            kept.append(block)
    return kept


def _same_clock(table: Table, left: Part, right: Part) -> bool:
    if not (left.clocks and right.clocks):
        return False
    pair = [table.columns[part.clocks[0]] for part in (left, right)]
    if any(isinstance(column, np.ndarray) for column in pair):
        return np.array_equal(np.asarray(pair[0], float), np.asarray(pair[1], float), True)
    return list(pair[0]) == list(pair[1])

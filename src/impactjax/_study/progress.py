"""Progress of a study."""

import datetime
import math
from typing import NamedTuple


class Progress(NamedTuple):
    """Progress of a study, told when it begins and after each chunk. As text it is a line with rate
    and time left.

    - `lanes`: number of all lanes.
    - `done`: number of lanes whose results are on the disk.
    - `rate`: lanes in a second since the first chunk, which waits for the compiler; NaN before the
      second chunk [1/s].
    - `note`: sentence about files that are computed anew; empty for most.
    """

    lanes: int
    done: int
    rate: float = math.nan
    note: str = ""

    @property
    def left(self) -> float:
        """Time that the other lanes take at this rate; NaN if it is not known [s]."""
        return (self.lanes - self.done) / self.rate if self.rate else math.nan

    def __str__(self) -> str:
        said = f"{self.done} of {self.lanes} lanes"
        if math.isfinite(self.left):
            left = datetime.timedelta(seconds=math.ceil(self.left))
            said = f"{said}, {self.rate:.3g} lanes/s, {left} left"
        return f"{self.note} {said}" if self.note else said

"""Tables of recurrences, each for more operations than the one before."""

from collections.abc import Mapping

from impactjax._series.recurrences.arithmetic import ARITHMETIC
from impactjax._series.recurrences.arrays import ARRAYS
from impactjax._series.recurrences.elementary import ELEMENTARY
from impactjax._series.recurrences.factorisations import FACTORISATIONS
from impactjax._series.recurrences.linear_systems import LINEAR_SYSTEMS
from impactjax._series.recurrences.series import Rule
from impactjax._series.recurrences.singular import SINGULAR
from impactjax._series.recurrences.switches import SWITCHING

Table = Mapping[str, Rule]  # by the name of the primitive

# Analytic wherever the value is finite, so that a step may start anywhere.
EVERYWHERE: Table = ARITHMETIC | ELEMENTARY | ARRAYS | LINEAR_SYSTEMS | FACTORISATIONS

# Roots, powers and angles too, away from their singular points; at these no coefficient is finite.
AWAY_FROM_SINGULARITIES: Table = EVERYWHERE | SINGULAR

# Operations that choose by the state too; a step must end where the choice changes.
BETWEEN_SWITCHES: Table = AWAY_FROM_SINGULARITIES | SWITCHING

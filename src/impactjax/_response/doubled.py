"""The verb `doubled`: the orbit of twice the period that branches off at a period doubling."""

import numpy as np

from impactjax._hybrid.equations import NO_EVENT
from impactjax._response.equations import Arcs, Itinerary


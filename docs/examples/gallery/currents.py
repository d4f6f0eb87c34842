"""Commands and coil currents.

The coil follows the command with a lag of 50 ms. [Actuation](actuation.md) has all effects
between command and force.
"""

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
comparison = iso.compare(
    isolated,
    el_centro_1940().cut(0.0, 8.0),
    ["on_off", "clipped_lqr"],
    driver=iso.CoilDriver(lag=0.05, high=3.0),
)
figure = comparison.plot("currents")

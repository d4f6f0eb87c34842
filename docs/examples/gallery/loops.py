"""Force-deformation loops.

The same isolators at constant current and under control.
[Magnetorheological elastomer](ideas/elastomer.md) explains the shape of a loop.
"""

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
comparison = iso.compare(isolated, el_centro_1940(), ["passive_off", "passive_on", "on_off"])
figure = comparison.plot("loops")

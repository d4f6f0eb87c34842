"""Time histories.

Base displacement and floor acceleration of several controllers. [Controllers](controllers.md)
explains them.
"""

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
comparison = iso.compare(isolated, el_centro_1940(), ["passive_off", "passive_on", "clipped_lqr"])
figure = comparison.plot("time_histories")

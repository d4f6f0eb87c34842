"""One run.

Histories, loop and current of a single run. [First run](tutorials/first_run.ipynb) explains it.
"""

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
run = iso.simulate(isolated, el_centro_1940(), "clipped_lqr")
figure = run.plot()

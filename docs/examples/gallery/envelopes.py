"""Peaks over the height.

Peak acceleration of each level and peak drift of each storey. [Isolation](ideas/isolation.md)
explains the exchange of acceleration for displacement.
"""

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
comparison = iso.compare(isolated, el_centro_1940(), ["passive_off", "passive_on", "clipped_lqr"])
figure = comparison.plot("floor_envelopes")

"""Energy ledger.

Stored and dissipated energy over time, and the closure error below.
[Energy ledger](ideas/energy.md) defines every term.
"""

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
figure = iso.compare(isolated, el_centro_1940(), ["passive_on", "on_off"]).plot("energy")

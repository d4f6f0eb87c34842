"""A law that is not registered: numbers that follow the current, a building on it, a run."""

from cubic import LAW

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.laws import CurrentDependence

# ascending powers of the current: 3e6 + 2e6 i N/m, and so on
numbers = CurrentDependence.polynomial({"k": [3e6, 2e6], "k3": 1e8, "c": [4e5, 1e5]})
isolators = iso.Device(LAW, numbers, current_range=(0.0, 3.0), name="cubic isolators")

run = iso.simulate(iso.reference_building().on(isolators), el_centro_1940(), "clipped_lqr")
print(f"base displacement {1e3 * run.criteria['peak_base_displacement_m']:.0f} mm")
print(f"ledger closes within {run.energy.closure_error:.1e}")

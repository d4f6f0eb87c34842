"""An effect that is not registered, around a published law."""

from slack import FORMS

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.effects import extend

plain = iso.law("standard_solid").with_parameters(k0=2.5e4, c0=1e4, k1=1e5)
device = extend(plain, [(FORMS[0], {"gap": 2e-4})])
for one in (plain, device):
    isolated = iso.reference_building().on(iso.reference_isolators(one))
    run = iso.simulate(isolated, el_centro_1940())
    print(f"{one.law.title}: {1e3 * run.criteria['peak_base_displacement_m']:.1f} mm")

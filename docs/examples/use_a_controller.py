"""A controller of one's own beside those that come with the program."""

from outwards import Outwards

import isolation_sim as iso
from ground_motions import el_centro_1940

isolated = iso.reference_building().on(iso.reference_isolators())
driver = iso.CoilDriver(lag=0.05)
sensors = iso.Sensors(noise={"velocity_m_s": 0.01}, seed=1)
comparison = iso.compare(
    isolated,
    el_centro_1940(),
    {"off": "passive_off", "on_off": "on_off", "outwards": Outwards(full_speed=0.4)},
    driver=driver,
    sensors=sensors,
)
print(comparison)

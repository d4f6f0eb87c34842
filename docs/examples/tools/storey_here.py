"""The isolated storey in isolation-sim."""

import isolation_sim as iso
from ground_motions import el_centro_1940

building = iso.shear_building(
    masses=[250e3],  # kg, floor
    stiffnesses=[1.1e8],  # N/m, storey
    base_mass=300e3,  # kg, slab
    damping_ratio=0.02,
)
isolator = iso.law(
    "bouc_wen",
    {
        "k": 5.4e6,  # N/m, after yielding
        "alpha": 48.6e6,  # N/m, of the hysteretic displacement
        "A": 1.0,
        "beta": 0.5 / 5.5e-3**2,  # yields at 5.5 mm
        "gamma": 0.5 / 5.5e-3**2,
        "n": 2.0,
        "c": 0.0,
        "F0": 0.0,
    },
)
record = el_centro_1940()
run = iso.simulate(building.on(isolator), record)

time = run.time  # s
base = run.output("base_displacement_m")
drift = run.output("floor1_displacement_m") - base
force = run.output("isolator_force_N")
peak_acceleration = run.criteria["peak_floor_acceleration_m_s2"]

"""A sweep over two quantities.

Peak floor acceleration over the intensity of El Centro and the constant current.
[Sweeps](sweeps.md) explains plans.
"""

import isolation_sim as iso

plan = {
    "name": "map",
    "scenario": {"controller": [{"name": "constant", "amperes": 1.0}]},
    "vary": [
        {"field": "ground.scale_to_pga_g", "label": "pga", "low": 0.1, "high": 0.5, "count": 9},
        {"field": "controller.amperes", "label": "current", "low": 0.0, "high": 3.0, "count": 13},
    ],
}
figure = iso.sweep(plan, out="map", workers=1).plot_map("pga", "current")

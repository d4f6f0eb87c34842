"""Studies that can be run: sweeps and scenarios, papers reproduced, benchmarks."""

STUDIES = {
    "benchmark_building": "the smart base-isolated benchmark building under seven records",
    "level_and_period": "which current level suits which isolation period",
    "fragility": "incremental dynamic analysis and fragility curves with confidence bounds",
    "controllers": "how much of what is physically possible each controller achieves",
    "mpc_levers": "what each lever of predictive control contributes",
    "robustness": "controllers whose model is wrong and whose computer is slow",
    "device_scaling": "how large the isolators should be, and how many",
    "yielding_storeys": "what isolation is worth when the storeys yield",
    "moat_wall": "what a moat wall does to the building that meets it",
    "building_record": "a real building on rubber isolators and a linear isolation layer",
    "damper_diagnosis": "what the Bouc-Wen law lacks to reproduce an MR damper",
    "published_isolator": "a published isolator law against its own paper's measurements",
    "searches": "which search finds a law's parameters, and at what price",
}
"""By name what a study is about: one module of this package, run by ``isolation-sim study NAME``.

See ``studies.study`` for what such a module holds.
"""

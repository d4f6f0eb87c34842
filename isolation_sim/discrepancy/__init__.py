"""Find the errors of a simulation and their causes.

One pipeline serves every kind of data (``diagnose.py``): fit the nominal model, search for causes
(``search.py``), analyse the nominal model's residual (``residuals.py``), infer shares, chances,
rivals and intervals (``inference.py``), and put the result (``diagnosis.py``) and its report steps
(``report_steps.py``) together. ``problem.py`` is the contract between the pipeline and the data;
``adapters`` has one module for each kind of data. The models that they fit are in ``device`` (a law
with effects on measured runs), ``loops`` (the same reduced to stiffness and damping) and
``building`` (a structure on isolators). ``decisions.py`` holds every constant that tunes a
statistical decision.
"""

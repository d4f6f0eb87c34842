"""The compiled time integration. Only ``loading`` and ``arguments`` are for the other modules."""

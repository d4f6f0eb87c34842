"""A building on isolators, changed by causes and compared with measured records."""

"""The causes that are tried for a building: isolators, structure, sensors."""

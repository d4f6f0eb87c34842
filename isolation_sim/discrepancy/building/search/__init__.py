"""The search for causes of a building."""

"""Files of loggers on a shaking table or in a building, imported as a building record."""

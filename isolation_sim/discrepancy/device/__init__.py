"""A law with effects around it, fitted to measured runs."""

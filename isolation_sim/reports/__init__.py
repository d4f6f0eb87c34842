"""Figures and tables of runs; matplotlib and rich are imported when they are used."""

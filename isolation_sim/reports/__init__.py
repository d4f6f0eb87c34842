"""Figures, tables and reports of results; matplotlib and rich are imported on first use."""

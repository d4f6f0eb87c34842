"""Written out for other programs: C for the laboratory."""

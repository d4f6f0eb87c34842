"""Files: TOML, CSV tables, netCDF, atomic writes, results folders."""

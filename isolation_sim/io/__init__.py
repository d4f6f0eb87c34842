"""Files: TOML, CSV tables, netCDF, atomic writes, folders of results."""

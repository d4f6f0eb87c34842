"""Puts the script of plotly.js into a wheel, so that an install does not need plotly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PlotlyScript(BuildHookInterface):
    """Takes the script from plotly's own package, which the build requires."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the script beside the reports; an editable install has plotly itself."""
        if version == "editable":
            return
        import plotly

        script = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
        build_data["force_include"][str(script)] = "isolation_sim/reports/html/plotly.min.js"

"""Puts the script of plotly.js beside the reports, so that an install does not need plotly."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PlotlyScript(BuildHookInterface):
    """Takes the script from plotly's own package, which the build requires."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the script to a wheel, or copy it into the checkout of an editable install."""
        import plotly

        script = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
        place = "isolation_sim/reports/html/plotly.min.js"
        if version == "editable":
            shutil.copyfile(script, Path(self.root) / place)
        else:
            build_data["force_include"][str(script)] = place

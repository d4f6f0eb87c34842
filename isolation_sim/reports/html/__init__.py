"""Reports as one HTML file each: `page` and `charts` are the parts of every report.

Jinja2 and Plotly are imported when a page is written.
"""

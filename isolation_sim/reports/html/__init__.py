"""Reports as one HTML file each: `page` and `charts` are what every report is made of.

Jinja2 and Plotly are imported when a page is written.
"""

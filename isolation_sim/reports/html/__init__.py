"""Reports as single HTML files, made with `page` and `charts`.

Jinja2 and Plotly are imported when a report is written.
"""

"""A report as one HTML file that needs no network: numbers in Python, looks in HTML, CSS and JavaScript."""

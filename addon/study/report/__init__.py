"""The report of a study: one HTML page with everything in it, which opens without a network. No bpy.

`page` puts sections together; a section is words, tables and charts; charts are SVG, coloured by the page's style, so
that they follow its dark form and its printed one.
"""

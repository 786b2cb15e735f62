"""The web page: a NiceGUI application within the gateway.

Each view is two files: ``NAME_view.py`` computes what is shown (pure), and ``NAME_page.py`` draws it. The views of a
session are computed from its :class:`~shift_gateway.web.history.SessionHistory`.
"""

"""The command ``shift-mesh``."""

"""The plugin: PyVista filters, MeshLab-style filter scripts and the command of imgquad-mesh."""

"""Between PyVista's datasets and the values of the core."""

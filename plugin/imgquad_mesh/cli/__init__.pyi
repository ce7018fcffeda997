from . import console, demo, list_filters, run, script, stack, studio, tiles

__all__ = ["console", "demo", "list_filters", "run", "script", "stack", "studio", "tiles"]

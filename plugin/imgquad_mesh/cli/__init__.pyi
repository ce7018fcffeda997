from . import console, demo, list_filters, run, script, stack, studio, tiles, warm

__all__ = ["console", "demo", "list_filters", "run", "script", "stack", "studio", "tiles", "warm"]

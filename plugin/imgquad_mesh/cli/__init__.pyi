from . import console, demo, list_filters, run, script, stack, studio

__all__ = ["console", "demo", "list_filters", "run", "script", "stack", "studio"]

from . import console, demo, list_filters, rock_picture, run, script, stack

__all__ = ["console", "demo", "list_filters", "rock_picture", "run", "script", "stack"]

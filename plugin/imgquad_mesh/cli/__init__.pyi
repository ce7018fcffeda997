from . import console, demo, list_filters, rock_picture, run, script

__all__ = ["console", "demo", "list_filters", "rock_picture", "run", "script"]

from . import crosscheck, pymeshlab_filters, script, templates

__all__ = ["crosscheck", "pymeshlab_filters", "script", "templates"]

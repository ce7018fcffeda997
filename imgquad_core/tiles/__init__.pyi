from .bands import ROUNDS, groups_of
from .grid import Grid, grid_of
from .job import Job
from .rules import Rules, legend_as_json, load_rules, rules_of, save_rules
from .sources import Source, source_of, stamp_of

__all__ = [
    "ROUNDS",
    "Grid",
    "Job",
    "Rules",
    "Source",
    "grid_of",
    "groups_of",
    "legend_as_json",
    "load_rules",
    "rules_of",
    "save_rules",
    "source_of",
    "stamp_of",
]

from .datasets.pictures import read
from .meshlab.crosscheck import crosscheck
from .meshlab.meshsets import from_meshset, to_meshset
from .meshlab.methods import install_meshlab_filters
from .meshlab.script import run_script

__all__ = ["crosscheck", "from_meshset", "install_meshlab_filters", "read", "run_script", "to_meshset"]

"""Files of other programs, each read in a process of its own with a limit of time and of memory.

door.converted: path -> a file that this package reads itself;    formats: one module each, which fills `exchange.Mesh`
"""

from . import door, exchange

__all__ = ["door", "exchange"]

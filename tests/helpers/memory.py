"""Memory that tests leave behind goes back to the machine: each worker of a run keeps a gigabyte free."""

import ctypes
import gc
import sys

MUCH = 600.0  # megabytes that a process may have before anything is given back
MORE = 40.0  # and how many more than after the last time
_kept = [MUCH]


def resident():
    """Return the memory of this process in megabytes; 0 where the system does not tell it so."""
    try:
        with open("/proc/self/status") as file:
            return next(int(line.split()[1]) / 1024 for line in file if line.startswith("VmRSS"))
    except OSError:
        return 0.0


def give_back():
    """Collect what is not used any more, where it is much: objects in circles, and free pages of the heap."""
    if resident() > _kept[0] + MORE:
        gc.collect()
        if sys.platform == "linux":
            getattr(ctypes.CDLL(None), "malloc_trim", lambda _: None)(0)
        _kept[0] = max(resident(), MUCH)

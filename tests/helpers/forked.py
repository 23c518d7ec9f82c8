"""What runs in a copy of this process, which begins at once and has all that was compiled."""

import os
import signal
import traceback


def begun(body, *arguments):
    """Return the number of a copy that runs a function, and ends with the code that it returns."""
    child = os.fork()
    if child:
        return child
    signal.alarm(60)  # rather than wait for ever
    code = 1
    try:
        code = body(*arguments) or 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def status(body, *arguments):
    """Run a function in a copy; return how that ended: 0, or with a code or by a signal."""
    return os.waitpid(begun(body, *arguments), 0)[1]

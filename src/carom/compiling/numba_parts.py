"""Parts of Numba that it promises to nobody: all are named here, each with what can take its place.

- Instructions of one's own (``cgutils``, ``infer``, ``infer_global``, ``make_intrinsic_template``):
  ``numba.extending.intrinsic``, which is inlined, so that room on the stack ends too early.
- A cast between types of one's own (``cpu_target``, ``Conversion``): a copy of the function for each type.
- Code on disk (``FunctionCache`` with its ``_impl``, ``_index_key`` and ``_cache_file``, ``Dispatcher`` with
  ``_cache`` and ``compile``, ``rtsys``): ``njit(cache=True)``, which misses edits to what is called.
- Few passes (``compiler``, ``PassManager._runPass``, ``PostProcessor``), no machine code of what is inlined
  (``JITCodeLibrary._finalize_final_module`` and others), one code for all callers (``builtin_registry``,
  ``_impl_cache`` of a template): all of them, a quarter more time to compile.
- News of what is being compiled (``event``): a line before each first call.
"""

# ruff: noqa: F401 (the other files of this package import them from here)
from numba.core import cgutils, compiler, event, typed_passes, untyped_passes
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_machinery import PassManager
from numba.core.dispatcher import Dispatcher
from numba.core.postproc import PostProcessor
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.typeconv import Conversion
from numba.core.typing.templates import builtin_registry, infer, infer_global, make_intrinsic_template

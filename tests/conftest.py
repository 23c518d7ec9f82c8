"""Settings of the whole test session."""

from hypothesis import settings

# The same examples in every run: a failure on one machine is a failure on all. Times vary with compilation.
settings.register_profile("carom", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("carom")

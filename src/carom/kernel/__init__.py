"""The engine: Numba only, models chosen by type. It knows numpy and nothing of carom above it."""

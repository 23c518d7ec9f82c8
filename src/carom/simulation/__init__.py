"""A scene in motion: run, sample, measure, save, load, log and replay.

Nothing here knows how an event is found: that is the engine's. Files and observables are handed in.
"""

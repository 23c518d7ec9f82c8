"""From a target to the run that reaches it for the least CPU time: ``carom plan``, ``carom.studies.plan``.

Pilots and plans run through the simulation.
"""

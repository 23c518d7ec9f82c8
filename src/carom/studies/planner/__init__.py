"""From a target to the run that reaches it for the least CPU time: ``carom plan``, ``carom.plan``.

Nothing here moves a component; the simulation runs pilots and plans.
"""

"""From a target to a run that reaches it in little CPU time: ``carom plan``, ``carom.plan``.

Nothing here moves a component; the simulation runs pilots and plans.
"""

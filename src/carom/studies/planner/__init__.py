"""From a target to the run that reaches it for the least CPU: ``carom plan``, ``carom.studies.plan``."""

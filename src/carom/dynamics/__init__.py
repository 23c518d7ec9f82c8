"""A scene in motion: what a :class:`carom.Simulation` is made of."""

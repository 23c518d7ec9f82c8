"""How scenes are checked, built and told: what :class:`carom.Scene` is made of."""

"""What tests of several rooms share: oracles, scenes, commands."""

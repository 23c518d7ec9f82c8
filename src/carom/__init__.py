"""Carom: event-driven molecular dynamics of hard particles in any dimension."""

__version__ = "0.1.0"

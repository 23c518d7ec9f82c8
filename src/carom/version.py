"""The version of Carom, which files and studies note beside what they hold."""

__version__ = "0.1.0"

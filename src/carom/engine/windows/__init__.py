"""Windows of time: parts of the box run on their own, and are compared afterwards (decision 41).

The main cycle is the plain one. Here is what lets several of them run on copies of one system.
"""

"""The main cycle and its arrays: it knows events, not physics.

Nothing here knows what a scene is, reads a file, or chooses a model: parts are placed as they are given.

Read it in this order: ``state`` (the arrays), ``cycle`` (the loop), ``events`` (what is planned for a
component), ``search`` (whom it meets next), ``calendar`` (which event is the next), ``collisions``,
``one_body`` and ``epochs`` (what happens). Then ``neighbors``, ``observers`` and ``domains``.
"""

"""Probabilities of failure in the space of independent standard normal variables, whatever fails.

Nothing here knows a mechanism: a `Problem` says at which points of the space which limit is broken.
"""

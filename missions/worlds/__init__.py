"""Parts of embedded worlds that several missions use; each mission's own world is in its folder.

A mission's options are what its operator knows. What is true, such as how a target moves and where a magnetic
one lies, is a field of the world only.
"""

"""The commands by which one finds one's way: describe, schema, new, example.

In: words of a command line. Out: text or JSON on stdout, new files, never over one that is there. Open `files` first.
"""

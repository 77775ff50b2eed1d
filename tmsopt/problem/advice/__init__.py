"""What to write instead: words for names and lines of a file that cannot be used.

In: the text as written. Out: the end of a sentence that says what to write, empty where nothing is known. Open `names`
first: every name that an expression may use, with its meaning.
"""

"""Commands about one design in motion: at which speeds it is stable, and what it does after a push.

In: a problem file, solved first if it frees parameters. Out: tables, JSON, CSV, figures. Open `simulate` first.
"""

"""The designs and figures of Kirillov (2018) as data."""

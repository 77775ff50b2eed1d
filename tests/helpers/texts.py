"""Problem files from texts, and what is wrong with them."""

import pytest

import tmsopt


def write(folder, text, name="problem"):
    """A file with this text."""
    file = folder / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    return file


def load(folder, text):
    """The problem of a text."""
    return tmsopt.load(write(folder, text))


def faults(folder, text, read=tmsopt.load):
    """The faults of a text, each without the path of its file."""
    file = write(folder, text)
    with pytest.raises(tmsopt.InputError) as caught:
        read(file)
    return [str(fault).removeprefix(f"{file}:") for fault in caught.value.faults]

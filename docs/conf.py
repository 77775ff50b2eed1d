"""The site: pages by hand, and what the program says of itself, written when it is built (`extensions/`).

Built by ``sphinx-build -nW docs build/docs``: nothing is asked of a network, and what is wrong is an error.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "agg")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # two examples at once
sys.path.insert(0, str(Path(__file__).parent))

import tmsopt

project, author = "tmsopt", "The tmsopt authors"
project_copyright = f"2026, {author}"
version = release = tmsopt.__version__
language = "en-GB"
smartquotes = False  # `--json` has two hyphens
exclude_patterns = ["_build", "**/.ipynb_checkpoints"]
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "extensions.gallery",
    "extensions.reference",
    "sphinx_gallery.gen_gallery",
]

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4
suppress_warnings = [
    "config.cache",  # the gallery's order is a function
    "ref.python",  # `abscissa` is a field of many results, and leads to none of them
]

html_theme = "furo"
html_title = f"tmsopt {release}"
html_static_path = ["static"]
html_css_files = ["tmsopt.css"]
html_show_sphinx = html_copy_source = html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True
copybutton_only_copy_prompt_lines = True

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_inherit_docstrings = False
napoleon_google_docstring, napoleon_numpy_docstring = True, False
napoleon_use_ivar, napoleon_attr_annotations = True, False

sphinx_gallery_conf = {
    "examples_dirs": "../build/examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"problems",
    "within_subsection_order": "extensions.gallery.place",
    "image_scrapers": ("extensions.gallery.drawn",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "parallel": 2,
}

# Names of other libraries in signatures lead nowhere without a network
nitpick_ignore_regex = [("py:.*", ".*")]

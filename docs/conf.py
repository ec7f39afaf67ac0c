"""Configuration of the documentation: `make docs` builds it into out/docs.

The build executes the notebooks and keeps their outputs in build/notebooks. With the environment variable NOTEBOOKS=off
it shows their code only.
"""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import pages

import withe

project, author, copyright = "withe", "The withe authors", "2026, the withe authors"
release = version = withe.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["README.md"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb", ".rst": "restructuredtext"}

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

nb_execution_mode = "off" if os.environ.get("NOTEBOOKS") == "off" else "cache"
# Outputs of another version of the package must not be shown, so each version has a cache of its own.
nb_execution_cache_path = str(pages.ROOT / "build" / "notebooks" / pages.digest_of_package())
nb_execution_timeout = 180  # [s], of a cell
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_merge_streams = True
# Kernels inherit the environment. Another backend than that of notebooks would show no figures.
os.environ.pop("MPLBACKEND", None)

autodoc_member_order = "groupwise"
autodoc_typehints = "none"  # docstrings have types with shapes and units
autosummary_generate = True
autosummary_imported_members = True
# Words in the types of attributes, such as the shape (frames, n), are the names of several attributes.
suppress_warnings = ["ref.python"]
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_param = False
napoleon_use_rtype = False
default_role = "code"
maximum_signature_line_length = 80  # a longer signature has a line for each argument

html_theme = "furo"
html_title = f"withe {release}"
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_theme_options = {"navigation_with_keys": True}

pages.write(Path(__file__).parent)


def setup(app: object) -> None:
    """Connect the functions that complete and check the reference."""
    app.connect("autodoc-process-docstring", pages.process_docstring, priority=900)  # after napoleon
    app.connect("autodoc-process-signature", pages.process_signature)
    app.connect("env-check-consistency", pages.report_missing)

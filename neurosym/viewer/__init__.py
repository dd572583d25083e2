"""A page to look at: the assembly in 3D, the plan as a film, and what the search knew and did.

`timeline`, `facts`, `solids`, `panels`, `steps` and `score_table` are pure: they know no server. `sources` opens what
there is to see, `planning` plans it, `exhibit` holds what is shown; `page`, `scene` and `form` show it with viser
(extra `viewer`), and `export` writes a page that needs no server, whose list keeps up with its film.
"""

from neurosym.errors import MissingDependencyError


def need_viser() -> None:
    """Say how to get viser where it is absent. Raises MissingDependencyError: viser is not installed."""
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise MissingDependencyError(
            f"Expected the package viser, which shows the page; {error}. "
            "Install the extra: pip install 'neurosym-assembly[viewer]'."
        ) from None

"""The local server: viser, quiet, on loopback, without the tunnel that shares a page with the world."""

from __future__ import annotations

import contextlib
import io

import viser


class LocalServer(viser.ViserServer):
    """A viser server that prints nothing and opens no tunnel.

    Args:
        host: which interface to listen on.
        port: which port; the next free one where it is taken, and any where it is 0.
        label: title of the panel.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, label: str | None = None) -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            super().__init__(host=host, port=port, label=label, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refused: a page that can ask for it would put the user's parts on somebody else's server."""
        return None

    def stop(self) -> None:
        """Stop serving."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()

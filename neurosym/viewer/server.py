"""The local server: viser, quiet, on loopback, for its own page alone, without the tunnel that shares a page."""

import contextlib
import functools
import io
import re
from collections.abc import Iterator

import viser
import websockets.asyncio.server

#: Addresses that this machine alone can reach.
LOOPBACKS = ("127.0.0.1", "localhost", "::1")

_OWN_PAGE = re.compile(r"https?://(127\.0\.0\.1|localhost|\[::1\])(:\d+)?")


class LocalServer(viser.ViserServer):
    """A viser server that prints nothing, opens no tunnel and, on loopback, hears no other site's page.

    Port 0 is any; where a port is taken, it is the next free one. The label is the title of the panel.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, label: str | None = None) -> None:
        with contextlib.redirect_stdout(io.StringIO()), _own_page_only(host in LOOPBACKS):
            super().__init__(host=host, port=port, label=label, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refused: a page that can ask for it would put the user's parts on somebody else's server."""
        return None

    def stop(self) -> None:
        """Stop serving."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()


@contextlib.contextmanager
def _own_page_only(wanted: bool) -> Iterator[None]:
    """Servers started inside refuse a web socket that a page of another origin opens: any site could, to read along."""
    serve = websockets.asyncio.server.serve
    if wanted:
        narrowed = functools.partial(serve, origins=[None, _OWN_PAGE])
        websockets.asyncio.server.serve = narrowed  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]

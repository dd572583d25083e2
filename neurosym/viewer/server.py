"""The local server: viser, quiet, on loopback, for its own page alone, without the tunnel that shares a page."""

import contextlib
import io
import re
import socket
from collections.abc import Iterator
from typing import Any

import viser
import websockets.asyncio.server

from neurosym.errors import InputError

#: Addresses that this machine alone can reach.
LOOPBACKS = ("127.0.0.1", "localhost", "::1")


def check_host(host: str) -> None:
    """Refuse (`InputError`) an address that is not one of this machine's, before anything is drawn for it."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as listener:
            listener.bind(address)
    except (OSError, UnicodeError) as error:
        raise InputError(
            f"Expected --host as an address of this machine, such as 127.0.0.1, or 0.0.0.0; got {host!r}: {error}."
        ) from None


class LocalServer(viser.ViserServer):
    """A viser server that prints nothing, opens no tunnel and, on loopback, hears no other site's page.

    Port 0 is any; where a port is taken, it is the next free one. The label is the title of the panel.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, label: str | None = None) -> None:
        if not port:  # known before the server starts, whose own page is named by it
            with socket.create_server((host, 0), family=socket.AF_INET6 if ":" in host else socket.AF_INET) as free:
                port = free.getsockname()[1]
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

    def narrowed(handler: Any, host: str, port: int, **options: Any) -> Any:
        own = re.compile(rf"https?://(127\.0\.0\.1|localhost|\[::1\]):{port}")
        return serve(handler, host, port, origins=[None, own], **options)

    if wanted:
        websockets.asyncio.server.serve = narrowed  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]

"""The command line. A command is one line here, and a function in `neurosym.commands`.

Exit codes are in `neurosym.commands.exit_codes`. Nothing heavy is imported before a command needs it.
"""

import io
import sys
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from neurosym import __version__
from neurosym.commands.compare import compare
from neurosym.commands.doctor import doctor, names
from neurosym.commands.exit_codes import BAD_INPUT, EXIT_CODES, INTERRUPTED
from neurosym.commands.inspect import count, export, inspect
from neurosym.commands.learn import demos, train
from neurosym.commands.plan import plan
from neurosym.commands.render import render
from neurosym.commands.replay import replay
from neurosym.commands.reproduce import reproduce, results
from neurosym.commands.spread import spread
from neurosym.commands.view import view
from neurosym.errors import NeurosymError

_TABLE = "Exit codes:\n\n" + "\n\n".join(f"{code}: {meaning}" for code, meaning in sorted(EXIT_CODES.items()))

app = typer.Typer(
    name="neurosym",
    help="Plan in which order things go together or come apart: symbols, geometry and learned priors.",
    epilog=_TABLE,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
#: What the command line offers, in the order in which `--help` lists it.
_COMMANDS: dict[str, Callable[..., None]] = {
    "compare": compare,
    "plan": plan,
    "view": view,
    "inspect": inspect,
    "count": count,
    "export": export,
    "demos": demos,
    "train": train,
    "render": render,
    "replay": replay,
    "reproduce": reproduce,
    "results": results,
    "list": names,
    "doctor": doctor,
}
for _name, _command in _COMMANDS.items():
    app.command(_name)(spread(_command))

#: What typer and click exit with when an option is wrong; ours is `BAD_INPUT`.
_USAGE = 2


def _version(wanted: bool) -> None:
    if wanted:
        print(f"neurosym {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say the version, and exit.")
    ] = False,
) -> None:
    pass


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, and leave with one of `EXIT_CODES`.

    `arguments`: as typed after `neurosym`; None takes those of the process.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names may have letters that the terminal has not
    try:
        app(args=None if arguments is None else list(arguments), prog_name="neurosym")
    except SystemExit as left:
        if left.code == _USAGE:
            sys.exit(BAD_INPUT)
        raise
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except (NeurosymError, OSError, NotImplementedError) as error:
        print(f"neurosym: {error}", file=sys.stderr)
        sys.exit(BAD_INPUT)


if __name__ == "__main__":
    main()

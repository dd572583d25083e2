"""What `neurosym` says to the shell: every exit code, in one table, which a test walks through the real commands."""

from neurosym.planning.result import Status

#: `doctor` found something amiss, or `replay` something that moved; also what typer leaves with when the reader of a
#: pipe has gone.
UNWELL = 1
#: Bad input: an option, a file or a name; a message on stderr says which, and what was expected.
BAD_INPUT = 33
#: Interrupted from the keyboard (128 + SIGINT, as shells count).
INTERRUPTED = 130
#: Exit code -> what it means.
EXIT_CODES: dict[int, str] = {
    **{status.exit_code: status.sentence for status in Status},
    UNWELL: "`neurosym doctor` found something that does not work, or `neurosym replay` something that moved.",
    BAD_INPUT: "Bad input: the message says what was expected, what came, and what to do.",
    INTERRUPTED: "Interrupted.",
}

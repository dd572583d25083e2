"""Where independent tasks run: in this process, in processes beside it, or on a Ray cluster.

A task's answer must depend on the task alone; then it is the same on every engine. To the last digit that takes the
same number of threads, too: worker processes and Ray's have one, and what runs in this process has what it was given.
"""

import os
import socket
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, NoReturn, TypeVar

from neurosym import __version__
from neurosym.errors import ContractError, InputError, MissingDependencyError, NeurosymError, UnknownNameError

Task = TypeVar("Task")
Result = TypeVar("Result")
#: Names of engines.
ENGINES = ("local", "ray")
#: How often Ray runs a task again whose node or process was lost, or that failed on its machine (no memory, no disk).
RETRIES = 5
#: A cluster that does not answer within so many seconds is not there. Ray itself would end the process, in two minutes.
REACH_SECONDS = 5.0


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_tasks(
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    *,
    engine: str = "local",
    workers: int | None = 1,
    address: str | None = None,
) -> Iterator[tuple[Task, Result]]:
    """Run a function on each task, and give (task, result) as they finish; a task that raises ends the run.

    Tasks run one in a process, and what they would fan out themselves stays in it. Function, tasks and results travel
    by cloudpickle, so a function may be a closure.

    Args:
        function: gives the same result for the same task, wherever and however often it runs: Ray runs tasks of a lost
            node again.
        engine: ``"local"``, or ``"ray"``: an existing Ray cluster, whose nodes all have this library.
        workers: most tasks at a time. Locally these are processes, None is one a processor, and 1 runs the tasks in
            this process; on Ray, None leaves it to the cluster.
        address: of the cluster, ``"HOST:PORT"``; None takes the environment's ``RAY_ADDRESS``, or the one that runs on
            this machine. A process that is connected to a cluster already stays with it.

    Raises:
        InputError: there is no cluster at the address.
        MissingDependencyError: Ray is not installed.
        NeurosymError: a worker process was killed, or Ray gave a task up.
    """
    if engine not in ENGINES:
        raise UnknownNameError("engine", engine, ENGINES)
    if workers is not None and workers < 1:
        raise InputError(f"Expected at least one worker; got {workers}.")
    if engine == "ray":
        return _on_ray(function, tasks, workers, address)
    if address is not None:
        raise InputError(f"Expected no address with engine='local'; got {address!r}. Did you mean engine='ray'?")
    if workers == 1:
        return ((task, function(task)) for task in tasks)
    return _in_processes(function, tasks, workers or cores())


def connection(engine: str, address: str | None = None) -> AbstractContextManager[Any]:
    """Stay connected, for several runs in a row; raises as `run_tasks` does. With the local engine it does nothing."""
    return _connected(address) if engine == "ray" else nullcontext()


def _in_processes(run: Callable[[Task], Result], tasks: Sequence[Task], workers: int) -> Iterator[tuple[Task, Result]]:
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky.process_executor import BrokenProcessPool

    # Left before the first result: a generator that is suspended inside would configure its caller, too.
    with parallel_config(backend="loky", inner_max_num_threads=1):
        pool = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1)
    finished = pool(delayed(_alone)(run, task, k) for k, task in enumerate(tasks))
    try:
        for k, result in finished:
            yield tasks[k], result
    except BrokenProcessPool as error:
        raise NeurosymError(
            "Expected the worker processes to stay; one was killed, perhaps for memory. Finished work is kept where "
            f"there is a journal: run it again, with fewer workers. ({error})"
        ) from error


def _alone(function: Callable[[Task], Result], task: Task, number: int) -> tuple[int, Result]:
    """One task in a process of its own: the other processors have tasks of their own."""
    from joblib import parallel_config

    with parallel_config(backend="sequential"):
        return number, function(task)


def _on_ray(
    run: Callable[[Task], Result], tasks: Sequence[Task], workers: int | None, address: str | None
) -> Iterator[tuple[Task, Result]]:
    """Ray's own tasks, run again elsewhere when a node is lost: joblib's pool on Ray does not outlive that."""
    with _connected(address) as ray:
        remote = ray.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=[OSError, MemoryError])(_on_node)
        waiting = deque(enumerate(tasks))
        flying: dict[Any, int] = {}
        try:
            while waiting or flying:
                while waiting and (workers is None or len(flying) < workers):
                    k, task = waiting.popleft()
                    flying[remote.remote(__version__, run, task, k)] = k
                for finished in ray.wait(list(flying), num_returns=1)[0]:
                    k = flying.pop(finished)
                    yield tasks[k], _fetched(ray, finished)
        finally:
            for unfinished in flying:
                ray.cancel(unfinished, force=True)


def _on_node(version: str, function: Callable[[Task], Result], task: Task, number: int) -> Result:
    if version != __version__:
        raise ContractError(f"Expected neurosym {version} on every node of the cluster; one has {__version__}.")
    return _alone(function, task, number)[1]


def _fetched(ray: Any, finished: Any) -> Any:
    try:
        return ray.get(finished)
    except ray.exceptions.RayTaskError as error:
        # The task's own exception, as any other engine would raise it; Ray's holds the trace from the node.
        raise getattr(error, "cause", None) or error from error
    except ray.exceptions.RayError as error:
        raise NeurosymError(f"Expected Ray to finish a task; after {RETRIES} retries it gave up: {error}") from error


@contextmanager
def _connected(address: str | None) -> Iterator[Any]:
    """The module ray, connected; what was connected here is left again."""
    try:
        import ray
    except ImportError:
        raise MissingDependencyError(
            "Expected Ray for engine='ray'; it is not installed. Install this package with its extra `ray`, here and "
            "on the cluster, or use engine='local'."
        ) from None
    if ray.is_initialized():
        yield ray
        return
    address = address or os.environ.get("RAY_ADDRESS") or "auto"
    _reach(address)
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (Exception, SystemExit) as error:  # what is no Ray cluster makes it leave the process
        _refuse(address, error)
    try:
        yield ray
    finally:
        ray.shutdown()


def _reach(address: str) -> None:
    """Refuse an address at which nobody listens."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if address == "auto":
        return
    if not colon or not port.isdecimal():
        raise InputError(f"Expected the address of a Ray cluster, HOST:PORT; got {address!r}.")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=REACH_SECONDS).close()
    except (OSError, OverflowError) as error:
        _refuse(address, error)


def _refuse(address: str, error: BaseException) -> NoReturn:
    where = "on this machine" if address == "auto" else f"at {address}"
    raise InputError(
        f"Expected a Ray cluster {where}; {type(error).__name__}: {error}. Start one (ray start --head), name another "
        "with its address, HOST:PORT, or use engine='local'."
    ) from error

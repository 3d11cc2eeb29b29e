"""A pool without threads."""

from concurrent.futures import Executor, Future


class OneAfterAnother(Executor):
    """Runs what it is given before it returns: to start and end eight threads takes a millisecond."""

    map = map

    def __init__(self, _threads: int) -> None:
        pass

    def submit(self, work, /, *arguments):
        done = Future()
        done.set_result(work(*arguments))
        return done

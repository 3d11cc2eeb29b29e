"""Limits of a scheduler (ulimit -v) below which tests run."""

import resource

LIFT = 'ulimit -S -v "$(ulimit -H -v)"; '
"""Words of a shell before it becomes a browser: a soft limit of the address space becomes the hard one."""


def require_addresses(program: str) -> None:
    """Skip the test if the hard limit of the address space keeps a browser from starting."""
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    if hard != resource.RLIM_INFINITY:
        import pytest

        pytest.skip(f"{program} reserves terabytes of addresses, and ulimit -v allows {hard // 10**6} MB")

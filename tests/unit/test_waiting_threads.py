"""Threads of the native kernels that have nothing to do leave their cores to others."""

import os
import re
import subprocess
import sys

import pytest

SETTING = "OMP_WAIT_POLICY"
PROGRAM = f"import os; from volprep.kernels import _native; print(os.environ.get('{SETTING}'))"


def loaded(chosen: dict[str, str]) -> tuple[int, str]:
    """Load the kernels; return how often OpenMP then looks before it sleeps, and what the environment says."""
    others = {name: value for name, value in os.environ.items() if name not in {SETTING, "GOMP_SPINCOUNT"}}
    environment = {**others, "OMP_DISPLAY_ENV": "verbose", **chosen}
    run = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, check=True, capture_output=True, text=True)
    found = re.search(r"GOMP_SPINCOUNT = '(\d+)'", run.stderr)
    if found is None:
        pytest.skip("only GCC's OpenMP shows it")
    return int(found[1]), run.stdout.strip()


def test_they_sleep_at_once_and_the_environment_stays_as_it_was() -> None:
    assert loaded({}) == (0, "None")


def test_those_of_flip_sleep_too() -> None:
    """They are of another OpenMP, which a wheel has brought along."""
    program = "import numpy as np; from volprep.truth.seen import seen_flip; print(seen_flip(*np.ones((2, 16, 16, 4))))"
    others = {name: value for name, value in os.environ.items() if name not in {SETTING, "GOMP_SPINCOUNT"}}
    environment = {**others, "OMP_DISPLAY_ENV": "verbose"}
    run = subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True)
    looks = re.findall(r"GOMP_SPINCOUNT = '(\d+)'", run.stderr)
    if len(looks) < 2:
        pytest.skip("only GCC's OpenMP shows it")
    assert set(looks) == {"0"}


def test_who_has_chosen_otherwise_gets_that() -> None:
    looks, setting = loaded({SETTING: "active"})
    assert looks > 1_000_000
    assert setting == "active"

"""A small batch that is disturbed as badly as possible; tests/benchmarks/batch_proof.py does the same with many."""

import json
import sys
from pathlib import Path

import pytest
from command_line import ended

ROOT = Path(__file__).parents[2]


@pytest.mark.long
def test_a_batch_with_killed_workers_that_is_killed_twice_ends_as_serial_builds_do() -> None:
    command = [sys.executable, "-m", "tests.benchmarks.batch_proof", "--scans", "9", "--kills", "3", "--every", "0.5"]
    proof = ended(command, cwd=ROOT, timeout=280)
    found = json.loads(proof.stdout)
    assert found["wrong"] == []
    assert proof.returncode == 0
    assert (found["scans"], found["damaged"], found["failed"]) == (9, 1, 1)
    assert found["workers_killed"] >= 1
    assert found["left_behind"] == []

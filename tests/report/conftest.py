"""A report with every part in it, without a scan, a package or a driver."""

import pytest
from sample_report import report_of

from volprep.validation.results.report import Report


@pytest.fixture(scope="session")
def report() -> Report:
    """A report that passes."""
    return report_of((0.002, 0.003, 0.0025))


@pytest.fixture(scope="session")
def changed_report() -> Report:
    """A report of a package whose mesh changes pictures."""
    return report_of((0.002, 0.003, 0.0025), same_pictures=False)

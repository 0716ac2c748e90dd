import pytest

from florence_bt.core.clock import ManualClock


@pytest.fixture
def clock():
    return ManualClock()

"""Numbers as C++ reads them."""

import pytest
from florence_btcpp.values import read_number


@pytest.mark.parametrize(
    ("text", "number"),
    [("7", 7), (" -7 ", -7), ("+7", 7), ("0.5", 0.5), ("1e3", 1000.0), ("-.5", -0.5)],
)
def test_numbers(text, number):
    read = read_number(text)
    assert read == number and type(read) is type(number)


@pytest.mark.parametrize("text", ["", "x", "1_000", "1_0.5", "nan", "inf", "1 2", "0x10", "7 m", "9" * 5000])
def test_what_is_no_number(text):
    assert read_number(text) is None

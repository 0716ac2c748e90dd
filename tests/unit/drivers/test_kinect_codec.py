import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError
from florence_bt.drivers.kinect.codec import (
    METRES_OF_RAW,
    metres_from_raw,
    millimetres_from_metres,
    pack_11_bit,
    packed_size,
    raw_from_metres,
    unpack_11_bit,
)
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame

RAW = st.lists(st.integers(0, 2047), max_size=40)


def reference_packing(values: list[int]) -> bytes:
    text = "".join(f"{value:011b}" for value in values)
    text += "0" * (-len(text) % 8)
    return bytes(int(text[at : at + 8], 2) for at in range(0, len(text), 8))


@settings(deadline=None)
@given(RAW)
def test_packing_is_the_bits_one_after_the_other(values: list[int]) -> None:
    packed = reference_packing(values)
    assert pack_11_bit(np.array(values, np.uint16)) == packed
    assert len(packed) == packed_size(len(values))
    assert unpack_11_bit(packed, len(values)).tolist() == values


def test_eight_values_take_eleven_bytes() -> None:
    assert packed_size(8) == 11
    assert packed_size(320 * 240) == 105_600
    assert unpack_11_bit(b"\xff" * 11, 8).tolist() == [2047] * 8


@pytest.mark.parametrize("length", [10, 12, 0])
def test_a_wrong_length_is_refused(length: int) -> None:
    with pytest.raises(FrameError, match="11 bytes"):
        unpack_11_bit(bytes(length), 8)


@pytest.mark.parametrize(
    ("raw", "metres"),
    [(500, 0.557), (600, 0.672), (700, 0.847), (800, 1.144), (900, 1.764), (1000, 3.848), (1050, 9.408)],
)
def test_metres_of_the_reference(raw: int, metres: float) -> None:
    assert METRES_OF_RAW[raw] == pytest.approx(metres, abs=6e-4)
    assert raw_from_metres(np.array([metres], np.float32))[0] == raw


def test_the_end_of_the_formula() -> None:
    assert METRES_OF_RAW[1083] == pytest.approx(202, abs=1)
    assert np.isnan(METRES_OF_RAW[1085:]).all()
    assert np.isnan(METRES_OF_RAW[2047])
    assert np.isfinite(METRES_OF_RAW[:1085]).all()
    assert (np.diff(METRES_OF_RAW[:1085]) > 0).all()


def test_images_keep_their_shape() -> None:
    raw = np.array([[500, 2047], [1000, 1100]], np.uint16)
    metres = metres_from_raw(raw)
    assert metres.shape == (2, 2)
    assert metres.dtype == np.float32
    assert np.isnan(metres).tolist() == [[False, True], [False, True]]


def test_what_has_no_raw_value() -> None:
    values = np.array([np.nan, np.inf, -np.inf, 0.0, -1.0, 0.2, 1e9, 1e-9], np.float32)
    assert raw_from_metres(values).tolist() == [2047] * 8


def test_raw_values_survive_the_way_through_metres() -> None:
    raw = np.arange(1084, dtype=np.uint16)
    assert (raw_from_metres(metres_from_raw(raw)) == raw).all()


@pytest.mark.parametrize(("metres", "step"), [(1.0, 0.003), (2.0, 0.012), (4.0, 0.050)])
def test_quantisation_grows_with_the_square_of_the_distance(metres: float, step: float) -> None:
    raw = int(raw_from_metres(np.array([metres], np.float32))[0])
    assert METRES_OF_RAW[raw + 1] - METRES_OF_RAW[raw] == pytest.approx(step, rel=0.15)
    assert abs(METRES_OF_RAW[raw] - metres) <= 0.51 * step * 1.15


def metres_from_millimetres(millimetres: NDArray[np.uint16]) -> NDArray[np.float32]:
    frame = DepthFrame(len(millimetres), 1, 0.0, millimetres, DepthEncoding.MILLIMETRES)
    return frame.metres()[0]


def test_millimetres() -> None:
    metres = np.array([1.2344, np.nan, 10.0, 10.5, -1.0, np.inf], np.float32)
    assert millimetres_from_metres(metres).tolist() == [1234, 0, 10000, 0, 0, 0]
    back = metres_from_millimetres(np.array([0, 1, 1234, 10000, 10001], np.uint16))
    np.testing.assert_allclose(back, [np.nan, 0.001, 1.234, 10.0, np.nan], rtol=1e-6)
    assert back.dtype == np.float32


@settings(deadline=None)
@given(st.lists(st.integers(1, 10000), min_size=1, max_size=20))
def test_millimetres_survive_the_way_through_metres(values: list[int]) -> None:
    millimetres = np.array(values, np.uint16)
    assert (millimetres_from_metres(metres_from_millimetres(millimetres)) == millimetres).all()

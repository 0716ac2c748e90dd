"""Compiled loops against plain ones, sizes, formulas, and coloured points."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.kinect.camera import BASELINE_M, View, camera_model
from florence_bt.drivers.kinect.codec import METRES_OF_RAW, METRES_TABLES, DepthFormula, pack_11_bit
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame

SIZES = st.tuples(st.integers(1, 24), st.integers(1, 9), st.integers(0, 2**32 - 1))


@settings(deadline=None)
@given(size=SIZES, step=st.integers(1, 4))
def test_every_encoding_gives_the_same_image(size: tuple[int, int, int], step: int) -> None:
    width, height, seed = size
    raw = np.random.default_rng(seed).integers(0, 2048, (height, width)).astype(np.uint16)
    expected = METRES_OF_RAW[raw][: height // step * step : step, : width // step * step : step]
    packed = DepthFrame(width, height, 0.0, pack_11_bit(raw))
    unpacked = DepthFrame(width, height, 0.0, raw, DepthEncoding.RAW)
    for frame in (packed, unpacked):
        np.testing.assert_array_equal(frame.metres(step), expected)
        np.testing.assert_array_equal(frame.raw(), raw)


def test_values_that_no_kinect_sends_mean_nothing() -> None:
    raw = np.array([[800, 2047, 2048, 65535]], np.uint16)
    assert np.isnan(DepthFrame(4, 1, 0.0, raw, DepthEncoding.RAW).metres()).tolist() == [
        [False, True, True, True]
    ]


def test_millimetres() -> None:
    values = np.array([[0, 1, 1144, 10_000, 10_001, 65535]], np.uint16)
    frame = DepthFrame(6, 1, 0.0, values, DepthEncoding.MILLIMETRES)
    np.testing.assert_allclose(
        frame.metres(), [[np.nan, 0.001, 1.144, 10.0, np.nan, np.nan]], rtol=1e-6, equal_nan=True
    )
    assert frame.raw().tolist()[0][2:] == [800, 1052, 2047, 2047]


@pytest.mark.parametrize(
    ("formula", "metres"),
    [
        (DepthFormula.A, [0.557, 0.672, 0.847, 1.144, 1.764, 3.848, 9.408]),
        (DepthFormula.B, [0.584, 0.706, 0.888, 1.195, 1.818, 3.779, 8.183]),
    ],
)
def test_the_table_of_the_reference(formula: DepthFormula, metres: list[float]) -> None:
    raw = np.array([[500, 600, 700, 800, 900, 1000, 1050]], np.uint16)
    driver = KinectDriver(KinectParameters(formula=formula))
    image = driver.depth(DepthFrame(7, 1, 0.0, raw, DepthEncoding.RAW), 0.0)
    assert image is not None
    np.testing.assert_allclose(image.depth[0], metres, atol=0.0006)


def test_the_ends_of_the_formulas() -> None:
    assert METRES_TABLES[DepthFormula.A][1083] == pytest.approx(202, rel=0.01)
    assert METRES_TABLES[DepthFormula.B][1083] == pytest.approx(35.4, rel=0.01)
    for table, last in ((METRES_TABLES[DepthFormula.A], 1084), (METRES_TABLES[DepthFormula.B], 1092)):
        assert np.isfinite(table[: last + 1]).all() and (np.diff(table[: last + 1]) > 0).all()
        assert np.isnan(table[last + 1 :]).all()


@pytest.mark.parametrize(
    ("width", "size"), [(640, (480, 640)), (320, (240, 320)), (160, (120, 160))], ids=str
)
def test_images_of_the_wanted_size(width: int, size: tuple[int, int]) -> None:
    raw = np.arange(480 * 640, dtype=np.uint32).astype(np.uint16).reshape(480, 640) % 1000
    pixels = np.random.default_rng(2).integers(0, 256, (480, 640, 3)).astype(np.uint8)
    driver = KinectDriver(KinectParameters(width=width))
    depth = driver.depth(DepthFrame(640, 480, 0.0, raw, DepthEncoding.RAW), 0.0)
    colour = driver.colour(VideoFrame(640, 480, 0.0, pixels), 0.0)
    assert depth is not None
    step = 640 // width
    assert depth.depth.shape == size and (depth.camera.width, depth.camera.fx) == (width, 525.0 / step)
    np.testing.assert_array_equal(depth.depth, METRES_OF_RAW[raw[::step, ::step]])
    np.testing.assert_array_equal(colour.pixels, pixels[::step, ::step])
    small = KinectDriver(KinectParameters(width=width)).colour(VideoFrame(4, 2, 0.0, bytes(24)), 0.0)
    assert small.pixels.shape == (2, 4, 3), "small images stay as they are"


def test_the_depth_cameras_own_axis() -> None:
    camera = camera_model(640, 480, View.DEPTH)
    assert (camera.cx, camera.cy) == (314.5, 235.5)
    half = camera_model(320, 240, View.DEPTH)
    assert (half.cx, half.cy) == (157.0, 117.5)


def frame_of(view: View) -> str:
    driver = KinectDriver(KinectParameters())
    image = driver.depth(DepthFrame(4, 2, 0.0, np.full((2, 4), 800, np.uint16), DepthEncoding.RAW, view), 0.0)
    assert image is not None
    return image.frame_id


def test_registered_images_are_the_colour_cameras() -> None:
    assert frame_of(View.COLOUR) == "camera_rgb_optical_frame"
    assert frame_of(View.DEPTH) == frame_of(View.SHARED) == "camera_depth_optical_frame"


def colours_of(points: np.ndarray) -> np.ndarray:
    return points.view(np.uint32)[..., 3]


def test_shared_lens_points_have_the_colours_of_their_pixels() -> None:
    random = np.random.default_rng(3)
    raw = random.integers(400, 1000, (240, 320)).astype(np.uint16)
    raw[3, 4] = 2047
    pixels = random.integers(1, 256, (240, 320, 3)).astype(np.uint8)
    driver = KinectDriver(KinectParameters())
    driver.depth(DepthFrame(320, 240, 0.0, raw, DepthEncoding.RAW, View.SHARED), 5.0)
    found = driver.coloured_points(driver.colour(VideoFrame(320, 240, 0.0, pixels), 5.02))
    assert found is not None
    image, points = found
    assert image.stamp == 5.0
    known = ~np.isnan(image.depth)
    assert np.isnan(points[3, 4, :3]).all() and colours_of(points)[3, 4] == 0
    wide = pixels.astype(np.uint32)
    expected = wide[..., 0] << 16 | wide[..., 1] << 8 | wide[..., 2]
    np.testing.assert_array_equal(colours_of(points)[known], expected[known])
    np.testing.assert_array_equal(points[..., 2][known], image.depth[known])
    x = (np.arange(320) - 159.5) / 262.5 * image.depth
    np.testing.assert_allclose(points[..., 0][known], x[known], atol=1e-5)


@pytest.mark.parametrize("distance_raw", [600, 800, 950])
def test_the_colour_camera_sees_a_point_further_left(distance_raw: int) -> None:
    driver = KinectDriver(KinectParameters(width=640))
    frame = DepthFrame(
        640, 480, 0.0, np.full((480, 640), distance_raw, np.uint16), DepthEncoding.RAW, View.DEPTH
    )
    image = driver.depth(frame, 0.0)
    assert image is not None
    columns = np.zeros((480, 640, 3), np.uint8)
    columns[..., 0] = np.arange(640) >> 8
    columns[..., 1] = np.arange(640) & 255
    found = driver.coloured_points(driver.colour(VideoFrame(640, 480, 0.0, columns), 0.0))
    assert found is not None
    seen = colours_of(found[1])[240, 300] >> 8
    z = float(image.depth[240, 300])
    expected = 300 + 5.0 - BASELINE_M * 525.0 / z
    assert seen == math.floor(expected + 0.5)
    if distance_raw == 600:
        assert (colours_of(found[1])[:, :13] == 0).all(), "what the colour camera does not see is black"


def test_points_need_a_new_depth_image_of_about_the_same_time() -> None:
    driver = KinectDriver(KinectParameters())
    raw = np.full((2, 4), 800, np.uint16)
    colour = driver.colour(VideoFrame(4, 2, 0.0, bytes(24)), 1.0)
    assert driver.coloured_points(colour) is None
    driver.depth(DepthFrame(4, 2, 0.0, raw, DepthEncoding.RAW), 1.05)
    assert driver.coloured_points(colour) is not None
    assert driver.coloured_points(colour) is None, "one cloud of each depth image"
    driver.depth(DepthFrame(4, 2, 0.0, raw, DepthEncoding.RAW), 1.2)
    assert driver.coloured_points(colour) is None


def test_how_long_it_has_been_quiet() -> None:
    driver = KinectDriver(KinectParameters())
    assert driver.silence(2.0, 5.0) == 3.0
    driver.depth(DepthFrame(4, 2, 0.0, np.full((2, 4), 800, np.uint16), DepthEncoding.RAW), 4.0)
    assert driver.silence(2.0, 5.0) == 1.0
    assert driver.silence(4.5, 5.0) == 0.5


@pytest.mark.parametrize(
    "wrong", [{"source": ""}, {"width": 300}, {"baseline": -0.1}, {"reopen_timeout_s": 0.0}], ids=str
)
def test_wrong_parameters(wrong: dict[str, object]) -> None:
    with pytest.raises(ConfigError):
        KinectParameters(**wrong)  # type: ignore[arg-type]
